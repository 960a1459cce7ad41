// SPDX-License-Identifier: MIT
// What the page says of keys and gestures, and the hints for hands without a mouse.

/// What the page itself does; the engine tells the rest.
const kPageKeys = [
  ["F1", "shows this help"],
  ["P", "shows or hides the instruments"],
  ["Arrows", "move the drill across the screen"],
  ["Page Up, Page Down", "push the drill in, or pull it out"],
  ["Shift + arrows", "turn the view"],
  ["Ctrl + arrows", "tilt the drill about its tip"],
  ["Escape", "stops the spindle, or closes this help"],
];
const kTouch = [
  ["one finger", "moves the drill across the screen"],
  ["two fingers", "turn the view, and a pinch brings it closer"],
  ["two taps", "take the drill to the bone under the finger"],
  ["buttons", "turn the spindle, push the drill in and pull it out"],
  ["pen", "moves the drill, and pressing turns the spindle"],
  ["pen's button", "pushes the drill in by a drag"],
];
const kGamepad = [
  ["left stick", "moves the drill across the screen"],
  ["right stick", "pushes the drill in (up), or pulls it out"],
  ["right trigger", "turns the spindle"],
  ["cross of buttons", "turns the view"],
  ["shoulder buttons", "smaller or larger tool"],
];
/// Keys of the native window that the page, or the browser, keeps for itself.
export const kOwnKeys = new Set(["F1", "F12", "P", "Escape"]);

/// A text of the engine as a sentence.
export const sentence = (text, end = ".") =>
  text === "" ? "" : text[0].toUpperCase() + text.slice(1) + (/[.!?]$/.test(text) ? "" : end);

/// A text that can be read at a glance: of what is quoted in it, ends are kept.
export const short = (text, most = 180) =>
  text.length <= most ? text : `${text.slice(0, most - 60).trimEnd()}…${text.slice(-59).trimStart()}`;

export function fillHelp(lists, words) {
  const part = (title, rows) => {
    const h = document.createElement("h3"), dl = document.createElement("dl");
    h.textContent = title;
    for (const [name, help] of rows) {
      const dt = document.createElement("dt"), dd = document.createElement("dd");
      [dt.textContent, dd.textContent] = [name, help];
      dl.append(dt, dd);
    }
    lists.append(h, dl);
  };
  part("Mouse", (words.mouse ?? []).map((m) => [m.gesture, m.help]));
  part("Keys", [...kPageKeys, ...(words.actions ?? []).filter((a) => !kOwnKeys.has(a.name)).map((a) => [a.name, a.help])]);
  part("Touch and pen", kTouch);
  part("Gamepad", kGamepad);
}

/// A hint of the engine speaks of mouse and keys; a hand on the glass has others.
export function hintFor(hint, touch) {
  if (!hint || !touch) return hint ?? "";
  if (/passes through/.test(hint)) return "The drill is in bone, and passes through it. Hold “Pull”.";
  if (/touches bone/.test(hint)) return "The drill touches bone. Hold “Spindle” and “Push”.";
  if (/Push the drill/.test(hint)) return "Push the drill into the bone with “Push”.";
  if (/[Pp]rotect/.test(hint)) return "Protection of structures is chosen among the instruments.";
  if (/cuts the picture/.test(hint)) return "“Cut open” shows the hole, and two fingers turn the view.";
  return "One finger moves the drill, two turn the view. “Push” brings it to the bone.";
}
