// SPDX-License-Identifier: MIT
// The engine's functions, as functions of JavaScript.

const kCalls = {
  // name: [result, arguments]; n number, s text
  words: ["s", ""], open: ["", "s"], open_volume: ["", "snnnnnnnnn"], opening: ["s", ""], frame: ["n", "nnn"],
  mouse_at: ["", "nn"], move: ["", "nn"], push: ["", "n"], turn: ["", "nn"], orbit: ["", "nn"], pan: ["", "nn"], zoom: ["", "n"],
  spindle: ["", "n"], act: ["", "s"], tool: ["", "s"], protect: ["", "s"], renderer: ["", "s"], law: ["", "n"],
  state: ["s", ""], history: ["n", "n"], history_count: ["n", ""], session: ["s", ""], play: ["s", "n"],
  stl: ["n", ""], nrrd: ["n", ""], file: ["n", ""], file_size: ["n", ""], context_lost: ["", ""], context_restored: ["", ""],
};
const kKinds = { n: "number", s: "string", "": null };

/// Starts the engine on a canvas. `stopped` is told once, with a sentence, if it ends by itself.
export async function startEngine(canvas, stopped) {
  let dead = false;
  const stop = (reason) => {
    if (dead) return;
    dead = true;
    console.error(reason);
    stopped("The engine has stopped, so the bone is lost; please reload the page to go on.");
  };
  const { default: createEngine } = await import("./engine.js");
  const module = await createEngine({ canvas, onAbort: stop });

  const engine = {};
  for (const [name, [result, types]] of Object.entries(kCalls)) {
    const call = module.cwrap(`te_${name}`, kKinds[result], [...types].map((t) => kKinds[t]));
    engine[name] = (...values) => {
      if (dead) return result === "s" ? "" : 0;
      try {
        return call(...values);
      } catch (error) {
        stop(error);
        return result === "s" ? "" : 0;
      }
    };
  }

  /// Bytes of the engine's memory, which may have moved since the last call.
  const memory = (at, length) => {
    const buffer = (module.wasmMemory ?? module.HEAPU8).buffer;
    return new Uint8Array(buffer, at, length);
  };
  /// Puts bytes into the engine's memory; 0 where there is no room.
  engine.keep = (bytes) => {
    let at = 0;
    try {
      at = module._malloc(bytes.length);
    } catch (error) {
      console.info(error);
    }
    if (at !== 0) memory(at, bytes.length).set(bytes);
    return at;
  };
  engine.forget = (at) => module._free(at);

  /// The last ticks as triples of force [N], torque [N m] and time [us], for use before the next call.
  engine.last = (ticks) => {
    const at = engine.history(ticks);
    const count = Math.min(engine.history_count(), ticks);
    return at === 0 || count === 0 ? new Float32Array() : new Float32Array(memory(at, 12 * count).buffer, at, 3 * count);
  };
  engine.replay = (text) => {
    const at = engine.keep(new TextEncoder().encode(`${text}\0`));
    if (at === 0) return "There is too little memory for that session.";
    const refused = engine.play(at);
    engine.forget(at);
    return refused;
  };
  /// A file that the engine wrote, as a copy; nothing where it could not.
  engine.written = (kind) => (engine[kind]() === 1 ? memory(engine.file(), engine.file_size()).slice() : null);
  engine.ended = () => dead;
  return engine;
}
