// SPDX-License-Identifier: MIT
import { startEngine } from "./engine_calls.js";
import { makeFiles } from "./files.js";
import { makeHand } from "./hand.js";
import { makePanel } from "./panel.js";
import { fillHelp, kOwnKeys, sentence, short } from "./words.js";

const $ = (id) => document.getElementById(id);
const kShownApart = 66; // [ms] between two states of the panel
const kBusyApart = 200; // [ms] between two pictures while a bone is made, which needs the processor
const kMostPixels = 3e6; // drawn; a finer screen gets a coarser picture
const kLongestFrame = 0.1; // [s]

/// One sentence instead of the picture.
function say(sentence) {
  $("sentence").textContent = sentence;
  $("sentence").hidden = false;
  $("opening").hidden = true;
  $("picture").inert = $("panel").inert = true;
}

/// Has the page answered by its service worker, so that memory can be shared. Returns a sentence where that cannot be,
/// and never where the page is loaded anew.
async function isolate() {
  const workers = navigator.serviceWorker;
  const reload = () => {
    history.replaceState({ reloaded: true }, "");
    location.reload();
    return new Promise(() => {});
  };
  const again = history.state?.reloaded === true;
  history.replaceState(null, "");
  if (!workers) {
    if (crossOriginIsolated) return "";
    return isSecureContext
      ? "This browser gives pages no service worker, perhaps in a private window, so please try an ordinary window or another browser."
      : "Drilling needs memory that browsers share over https only, so please open this page's https address.";
  }
  let failed = false;
  try {
    const registration = await workers.register("service_worker.js");
    if (registration.waiting && !again) {
      const taken = new Promise((done) => {
        workers.addEventListener("controllerchange", done, { once: true });
        setTimeout(done, 3000);
      });
      registration.waiting.postMessage("take over");
      await taken;
      return await reload();
    }
    if (crossOriginIsolated) return "";
    await workers.ready;
  } catch (error) {
    console.info(error);
    failed = true;
  }
  if (crossOriginIsolated) return "";
  if (!failed && !again) return reload();
  if (window.top !== window) return "Inside another page the drill gets no shared memory, so please open it in a window of its own.";
  return "This browser does not let the page share memory, so please allow its service worker and storage, or try another browser.";
}

/// The context that the engine finds on its canvas: one is enough, since each takes a tenth of a second.
const hasWebGl2 = (canvas) =>
  canvas.getContext("webgl2", { alpha: false, depth: false, antialias: false, powerPreference: "high-performance" }) !== null;

async function run() {
  const canvas = $("canvas");
  $("opening").hidden = false;
  if (!hasWebGl2(canvas))
    return say("The picture needs WebGL 2, so please switch on hardware acceleration, or try a newer browser.");
  const refusal = await isolate();
  if (refusal) return say(refusal);

  let engine = null;
  try {
    engine = await startEngine(canvas, say);
  } catch (error) {
    console.error(error);
    return say("The engine could not be loaded, so please check the connection and reload the page.");
  }
  const words = JSON.parse(engine.words() || "{}");
  const acts = new Set((words.actions ?? []).map((a) => a.name).filter((name) => !kOwnKeys.has(name)));
  fillHelp($("help_lists"), words);

  // The bone that is open, and the one that was asked for.
  const bone = $("bone");
  let open = "", asked = null, state = {}, busyFiles = false;
  const refuse = (text) => {
    $("refusal_text").textContent = sentence(short(text));
    $("refusal").hidden = text === "";
  };
  const showBusy = (text, cancel) => {
    if (!$("opening").hidden && $("opening_text").textContent === text) return;
    $("opening_text").textContent = text;
    $("opening").hidden = text === "";
    $("cancel").hidden = !cancel;
    $("cancel").onclick = cancel ?? null;
  };
  /// One bone is made at a time.
  const wait = (name) => {
    hand.stop();
    asked = name;
    for (const id of ["bone", "open_volume", "open_folder"]) $(id).disabled = name !== null;
  };
  const openKind = (kind) => {
    wait(kind);
    engine.open(kind);
  };
  const opened = (name) => {
    refuse("");
    wait(name);
    if (![...bone.options].some((o) => o.value === name)) bone.add(new Option(name, name));
    bone.value = name;
  };
  const watchOpening = () => {
    if (asked === null) return;
    const text = engine.opening();
    if (text && !text.startsWith("!")) return busyFiles || showBusy(sentence(text, ""));
    if (text) {
      refuse(text.slice(1));
      if (!kKinds.has(asked) && asked !== open) bone.selectedOptions[0]?.remove();
      bone.value = open;
      // The graphics card may have had no room for it, and then there is no bone.
      if (!JSON.parse(engine.state() || "{}").title && asked !== "tooth") return openKind((bone.value = kKinds.has(open) ? open : "tooth"));
    } else {
      // A volume of one's own can be chosen only by opening it again.
      for (const o of [...bone.options]) if (!kKinds.has(o.value) && o.value !== asked) o.remove();
      open = bone.value = asked;
    }
    wait(null);
    hand.lose();
    if (!busyFiles) showBusy("");
  };
  const kKinds = new Set([...bone.options].map((o) => o.value));
  bone.addEventListener("change", () => {
    refuse("");
    openKind(bone.value);
  });
  $("refusal_close").addEventListener("click", () => {
    refuse("");
    canvas.focus();
  });

  const panel = makePanel(engine, words, () => canvas.focus({ preventScroll: true }));
  const showHelp = () => {
    hand.stop();
    if (!$("help").open) $("help").showModal();
  };
  $("show_help").addEventListener("click", showHelp);
  const hand = makeHand(canvas, $("spindle"), [[$("push_in"), 1], [$("pull_out"), -1]], engine, {
    help: showHelp,
    fold: panel.fold,
    letters: () => $("letters").checked,
    acts: (name) => acts.has(name),
    spindle: () => Boolean(state.spindle),
    pixel: () => {
      const now = JSON.parse(engine.state() || "{}");
      return Array.isArray(now.pixel) && now.pixel.every(Number.isFinite) ? { x: now.pixel[0], y: now.pixel[1] } : null;
    },
  });
  $("home").addEventListener("click", hand.lose);
  makeFiles(engine, {
    busy: (text, cancel) => {
      busyFiles = true;
      refuse("");
      showBusy(text, cancel);
    },
    idle: () => {
      busyFiles = false;
      showBusy("");
    },
    refuse,
    stop: () => hand.stop(),
    opened,
    opening: () => asked !== null,
  });

  canvas.addEventListener("webglcontextlost", (e) => {
    e.preventDefault();
    hand.stop();
    engine.context_lost();
  });
  canvas.addEventListener("webglcontextrestored", () => engine.context_restored());

  document.body.classList.remove("starting");
  openKind(kKinds.has(location.hash.slice(1)) ? (bone.value = location.hash.slice(1)) : "tooth");

  let last = performance.now(), shown = -Infinity, drawn = -Infinity;
  function frame(now) {
    if (engine.ended()) return;
    const dt = Math.min(Math.max((now - last) / 1e3, 0), kLongestFrame);
    last = now;
    const { clientWidth, clientHeight } = canvas;
    const ratio = Math.min(devicePixelRatio, Math.sqrt(kMostPixels / Math.max(1, clientWidth * clientHeight)));
    const width = Math.max(16, Math.round(clientWidth * ratio)), height = Math.max(16, Math.round(clientHeight * ratio));
    if (canvas.width !== width || canvas.height !== height) {
      Object.assign(canvas, { width, height });
      hand.lose();
    }
    watchOpening();
    hand.frame(dt);
    if (asked === null || now - drawn > kBusyApart) {
      drawn = now;
      engine.frame(dt, width, height);
    }
    if (now - shown > kShownApart) {
      shown = now;
      state = JSON.parse(engine.state() || "{}");
      if (state.title) panel.show(state, { now, touch: hand.touch() });
    }
    requestAnimationFrame(frame);
  }
  requestAnimationFrame(frame);
}

run().catch((error) => {
  console.error(error);
  say("The page could not start, so please reload it or try another browser.");
});
