// SPDX-License-Identifier: MIT
import { plot } from "./plot.js";
import { hintFor, sentence } from "./words.js";

const $ = (id) => document.getElementById(id);
const kShown = 3000; // ticks in a plot
const kToldApart = 2000; // [ms] between two changes that a screen reader hears
const kFiguresApart = 150; // [ms] between two changes of numbers, so that they can be read
const kReadApart = 1000; // [ms] between two changes of the plots' descriptions

const set = (id, text) => {
  const e = $(id);
  if (e.textContent !== text) e.textContent = text;
};
const press = (id, on) => $(id).setAttribute("aria-pressed", String(Boolean(on)));
const fixed = (v, digits) => (Number.isFinite(v) ? v.toFixed(digits) : "–");

/// A time of three digits.
const inTime = (us) => (us < 999.5 ? `${fixed(us, 0)} µs` : `${fixed(us / 1e3, us < 9950 ? 1 : 0)} ms`);

function fill(select, names) {
  select.replaceChildren(...names.map((name) => new Option(name, name)));
}
function choose(select, value) {
  if (value === undefined || document.activeElement === select || select.value === value) return;
  if (![...select.options].some((o) => o.value === value)) select.add(new Option(value, value));
  select.value = value;
}

/// Controls and instruments. `refocus` gives the picture the keys back.
export function makePanel(engine, words, refocus) {
  fill($("tool"), [words.burr ?? "burr", ...(words.families ?? [])]);
  fill($("renderer"), words.renderers ?? []);
  fill($("protection"), words.protections ?? []);

  for (const [id, act] of Object.entries({
    undo: "U", restore: "Backspace", clip: "C", marks: "M", home: "H", smaller: "[", larger: "]",
  }))
    $(id).addEventListener("click", () => engine.act(act));
  const onChoice = (id, call) =>
    $(id).addEventListener("change", (e) => {
      call(e.target.value);
      refocus();
    });
  onChoice("tool", engine.tool);
  onChoice("renderer", engine.renderer);
  onChoice("protection", engine.protect);
  $("law").addEventListener("change", (e) => engine.law(e.target.checked ? 1 : 0));

  const body = document.body;
  const fold = (on) => {
    body.classList.toggle("folded", on);
    $("fold").textContent = on ? "Instruments" : "Hide";
    $("fold").setAttribute("aria-expanded", String(!on));
  };
  $("fold").addEventListener("click", () => fold(!body.classList.contains("folded")));
  fold(matchMedia("(max-width: 35rem), (max-width: 50rem) and (orientation: portrait)").matches);

  const live = { said: "", due: "", last: -Infinity };
  let figures = -Infinity, read = -Infinity;

  /// Says what changed, seldom enough to be heard out.
  function say(state, now) {
    live.due = [
      state.spindle ? "spindle on" : "spindle off", state.touch,
      state.alert ? state.status : "", state.structure?.warns ? `${state.structure.words}: ${state.structure.name}` : "",
      state.note,
    ].filter(Boolean).join(", ");
    if (live.due === live.said || now - live.last < kToldApart) return;
    [live.said, live.last] = [live.due, now];
    set("live", live.due);
  }

  /// Its place stays while no structure is near, so that nothing below it moves.
  function structure(s, guarded) {
    $("structure").hidden = !guarded;
    if (!guarded) return;
    set("structure_name", s?.name ?? "–");
    set("structure_distance", s ? `${fixed(s.distance_mm, 2)} mm` : "");
    set("structure_words", s?.words ?? "–");
    $("structure_words").className = s?.warns ? (s.distance_mm < 0 ? "alarm" : "alert") : "";
    set("structure_felt", s?.felt || "No soft structure is felt");
    set("structure_push", `${fixed(s?.push_N, 2)} N`);
    set("structure_taken", `${fixed(s?.taken_mm3, 2)} mm³`);
    set("structure_refused", `${fixed(s?.refused_mm3, 2)} mm³`);
  }

  function plots(state, now) {
    if (body.classList.contains("folded")) return;
    const ticks = engine.last(kShown);
    const force = plot($("plot_force"), ticks, 0, 1, 2, "#8cc4ff");
    const torque = plot($("plot_torque"), ticks, 1, 1e3, 20, "#c9a6ff");
    const time = plot($("plot_tick"), ticks, 2, 1, 50, "#8cd98c");
    if (now - read > kReadApart) {
      read = now;
      const label = (id, text) => $(id).setAttribute("aria-label", text);
      label("plot_force", `Force over time: now ${fixed(state.force_N, 1)} newtons, at most ${fixed(force, 1)}`);
      label("plot_torque", `Torque over time: now ${fixed(state.torque_mNm, 1)} millinewton metres, at most ${fixed(torque, 1)}`);
      label("plot_tick", `Time of a tick: now ${fixed(state.tick_us, 0)} microseconds, at most ${fixed(time, 0)}`);
      set("tick", `${inTime(state.tick_us)}, at most ${inTime(time)}; late ${state.late ?? 0}`);
    }
    set("force", `${fixed(state.force_N, 2)} N, at most ${fixed(force, 2)}`);
    set("torque", `${fixed(state.torque_mNm, 1)} mN m, at most ${fixed(torque, 1)}`);
  }

  return {
    fold: () => fold(!body.classList.contains("folded")),
    /// Shows a state of the engine.
    show(state, { now, touch }) {
      set("title", state.title ?? "");
      set("spindle_state", state.spindle ? "spindle on" : "spindle off");
      $("spindle_state").classList.toggle("on", Boolean(state.spindle));
      set("touch", state.touch ?? "");
      set("status", state.failed ? "The drill has stopped: reload the page to go on." : sentence(state.note || (state.playing ? "replays a session" : state.status ?? ""), ""));
      $("status").className = state.failed ? "alarm" : state.alert || state.note ? "alert" : "";
      press("spindle", state.spindle);
      press("clip", state.clipped);
      press("marks", state.marks);
      $("undo").disabled = state.can_undo === false;
      choose($("tool"), state.family || words.burr);
      choose($("renderer"), state.renderer);
      choose($("protection"), state.protection);
      $("law").checked = Boolean(state.law);
      $("protect_row").hidden = !state.guarded;
      const hint = hintFor(state.hint, touch);
      set("hint", hint);
      $("hint").hidden = hint === "";
      structure(state.structure ?? null, Boolean(state.guarded));
      say(state, now);
      if (now - figures < kFiguresApart) return;
      figures = now;
      set("removed", `${fixed(state.removed_mm3, 1)} mm³`);
      set("brief_force", fixed(state.force_N, 2));
      set("brief_removed", fixed(state.removed_mm3, 1));
      $("law_figures").hidden = !state.law;
      const turns = state.rpm > 0;
      set("thrust", turns ? `${fixed(state.thrust_N, 1)} N` : "–");
      set("cutting_torque", turns ? `${fixed(state.cutting_torque_mNm, 1)} mN m` : "–");
      set("rpm", turns ? `${fixed(state.rpm, 0)} rpm` : "–");
      set("report", state.report ?? "");
      plots(state, now);
    },
  };
}
