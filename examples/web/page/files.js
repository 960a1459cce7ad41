// SPDX-License-Identifier: MIT
// Opens volumes and sessions, by buttons or by drop, and saves bone and sessions. All of it stays on this computer.

const $ = (id) => document.getElementById(id);
const kMostVoxels = 110e6, kMostOnSmallDevices = 40e6;
const kMostSession = 200e6; // bytes of text

const plain = (v) => String(+v.toPrecision(3));

/// All files of what was dropped, also those in folders.
async function dropped(transfer) {
  const entries = [...transfer.items].filter((i) => i.kind === "file").map((i) => i.webkitGetAsEntry?.() ?? null);
  if (entries.length === 0 || entries.includes(null)) return [...transfer.files];
  const files = [];
  const walk = async (entry) => {
    if (entry.isFile) return void files.push(await new Promise((done, failed) => entry.file(done, failed)));
    const reader = entry.createReader();
    for (;;) {
      const some = await new Promise((done, failed) => reader.readEntries(done, failed));
      if (some.length === 0) return;
      for (const e of some) await walk(e);
    }
  };
  for (const entry of entries) await walk(entry);
  return files.filter((f) => !f.name.startsWith("."));
}

/// `page` has busy(text, cancel) and idle() for work that goes on, refuse(sentence), stop() of the spindle, opened(name):
/// the engine was asked for that volume, and opening(): whether it makes a bone now.
export function makeFiles(engine, page) {
  let worker = null;

  function cancel() {
    worker?.terminate();
    worker = null;
    page.idle();
  }

  async function open(files) {
    if (files.length === 0) return;
    if (page.opening()) return page.refuse("A bone is being made, so please wait until it is there.");
    cancel();
    if (files.length === 1 && /\.session$/i.test(files[0].name)) return replay(files[0]);
    if (files.length > 1 && files.some((f) => /\.(nii|nii\.gz|nrrd|session)$/i.test(f.name)))
      return page.refuse("Several files at once are read as the slices of one DICOM series, so please choose one volume.");
    if (/\.nhdr$/i.test(files[0].name))
      return page.refuse(`${files[0].name} keeps its voxels in another file, so please save it as one .nrrd file.`);
    page.busy(`Reading ${files.length > 1 ? `${files.length} files` : files[0].name}`, cancel);
    const mine = (worker = new Worker("read/worker.js", { type: "module" }));
    const most = (navigator.deviceMemory ?? 8) <= 4 ? kMostOnSmallDevices : kMostVoxels;
    const refuse = (sentence) => {
      if (worker !== mine) return;
      cancel();
      page.refuse(sentence);
    };
    mine.onerror = (e) => {
      e.preventDefault();
      refuse("The volume's reader could not start, or ran out of memory; please try again, or a smaller volume.");
    };
    mine.onmessage = ({ data }) => {
      if (worker !== mine) return;
      if (data.progress) return page.busy(data.progress, cancel);
      if (data.refused) return refuse(data.refused);
      cancel();
      ask(data.volume);
    };
    mine.postMessage({ files, most });
  }

  /// Shows what was read, and opens it with the isovalue that the user chooses.
  function ask(volume) {
    const [x, y, z] = volume.spacing.map((s) => plain(1e3 * s));
    $("volume_text").textContent = `${volume.name}: ${volume.size.join(" × ")} voxels of ${x} × ${y} × ${z} mm, densities from ${volume.least} to ${volume.most}.`;
    $("volume_notes").replaceChildren(...volume.notes.map((note) => Object.assign(document.createElement("li"), { textContent: note })));
    const iso = $("isovalue");
    Object.assign(iso, { min: volume.least + 1, max: volume.most, value: Math.min(Math.max(volume.isovalue, volume.least + 1), volume.most) });
    $("isovalue_help").textContent = volume.hounsfield
      ? "These look like Hounsfield units, where 300 shows most bone and 1000 only dense bone."
      : "These are not Hounsfield units, so the value lies midway between the dark and the bright voxels.";
    const dialog = $("volume");
    dialog.returnValue = "cancel";
    dialog.onclose = () => {
      if (dialog.returnValue === "open") give(volume, iso.valueAsNumber);
    };
    page.stop();
    if (!dialog.open) dialog.showModal();
    iso.select();
  }

  function give({ name, size, spacing, frame, voxels }, isovalue) {
    const at = engine.keep(new Uint8Array(voxels.buffer, voxels.byteOffset, voxels.byteLength));
    if (at === 0) return page.refuse("This device has too little memory for that volume.");
    const frameAt = engine.keep(new Uint8Array(Float64Array.from(frame).buffer));
    engine.open_volume(name, ...size, ...spacing, frameAt, at, isovalue); // copies both
    engine.forget(frameAt);
    engine.forget(at);
    page.opened(name);
  }

  async function replay(file) {
    if (file.size > kMostSession) return page.refuse(`${file.name} is too long for a session.`);
    let refused = null;
    try {
      refused = engine.replay(await file.text());
    } catch {
      refused = `${file.name} cannot be read.`;
    }
    if (refused) page.refuse(refused);
  }

  function save(data, name, type) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([data], { type }));
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60e3);
  }
  function saveBone(kind, type) {
    const data = engine.written(kind);
    if (!data) return page.refuse(`The bone could not be written as ${kind.toUpperCase()}.`);
    save(data, `bone.${kind}`, type);
  }
  $("save_stl").addEventListener("click", () => saveBone("stl", "model/stl"));
  $("save_nrrd").addEventListener("click", () => saveBone("nrrd", "application/octet-stream"));
  $("save_session").addEventListener("click", () => save(engine.session(), "trephine.session", "text/plain"));

  for (const [button, input, take] of [
    ["open_volume", "volume_input", open], ["open_folder", "folder_input", open], ["replay", "session_input", (files) => files[0] && replay(files[0])],
  ]) {
    $(button).addEventListener("click", () => $(input).click());
    $(input).addEventListener("change", () => {
      const files = [...$(input).files].filter((f) => !f.name.startsWith("."));
      $(input).value = "";
      take(files);
    });
  }
  $("open_folder").hidden = !("webkitdirectory" in HTMLInputElement.prototype);

  const carries = (e) => [...(e.dataTransfer?.types ?? [])].includes("Files");
  addEventListener("dragover", (e) => {
    if (!carries(e)) return;
    e.preventDefault();
    $("drop").hidden = false;
  });
  addEventListener("dragleave", (e) => {
    if (e.relatedTarget === null) $("drop").hidden = true;
  });
  addEventListener("drop", async (e) => {
    $("drop").hidden = true;
    if (!carries(e)) return;
    e.preventDefault();
    try {
      open(await dropped(e.dataTransfer));
    } catch {
      page.refuse("The browser could not read what was dropped.");
    }
  });
}
