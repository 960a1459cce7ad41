// SPDX-License-Identifier: MIT
// The engine alone, on a blank document of the page's own server: for scripts in simulated time.
import { sleep } from "./browser.mjs";

/// Starts the engine in a tab and opens a made bone. Functions `te_*` are in `globalThis.engine`.
export async function bare(browser, url, bone) {
  const page = await browser.newPage();
  await page.goto(`${url}licences.txt`); // a file without a script, from a server that isolates it
  await page.evaluate(async () => {
    document.body.append(Object.assign(document.createElement("canvas"), { id: "canvas", width: 320, height: 240 }));
    const { default: create } = await import("/engine.js");
    const module = await create({ canvas: document.getElementById("canvas") });
    const call = (name, result, ...types) => module.cwrap(`te_${name}`, result, types);
    globalThis.engine = {
      open: call("open", null, "string"), opening: call("opening", "string"), frame: call("frame", "number", "number", "number", "number"),
      run: call("run_script", "string", "string"), state: call("state", "string"), play: call("play", "string", "string"),
      bytes: () => module.wasmMemory.buffer.byteLength,
    };
  });
  await change(page, bone);
  return page;
}

/// Opens another made bone in it.
export async function change(page, bone) {
  await page.evaluate((name) => engine.open(name), bone);
  for (let i = 0; i < 1200; ++i) {
    const text = await page.evaluate(() => engine.opening());
    if (text === "") return;
    if (text.startsWith("!")) throw new Error(text);
    await sleep(100);
  }
  throw new Error(`${bone} does not open`);
}

/// Plays a session in simulated time; see `te_run_script`.
export async function run(page, session) {
  const end = JSON.parse(await page.evaluate((text) => engine.run(text), session));
  if (end.refused) throw new Error(end.refused);
  return end;
}
