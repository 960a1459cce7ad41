// SPDX-License-Identifier: MIT
// Mouse, touch, pen, keys and gamepad move the drill and the view. Lengths go to the engine in its pixels.

const kWheelStep = 0.4e-3; // of a notch [m], as in the native window
const kDragStep = 0.05e-3; // of a CSS pixel [m], likewise
const kPushSpeed = 3e-3; // of keys, buttons and sticks [m/s]
const kMoveSpeed = 130; // likewise, of the drill on the screen [CSS pixels/s]
const kTurnSpeed = 220; // likewise, of the view and of a tilt [CSS pixels/s]
const kPixelsPerNotch = 100; // of a wheel
const kTap = 350; // a shorter press is a tap [ms]
const kTwoTaps = 320; // between two taps [ms], at most
const kTapReach = 24; // of a tap's motion, and between two [CSS pixels]
const kPenPressure = 0.15; // turns the spindle
const kDead = 0.15; // of a stick's way
const kNotch = Math.log(1.15); // of the view's distance

const kRepeats = new Set(["[", "]", "+", "-"]);
const kNames = { " ": "Space", "=": "+", _: "-" };

/// Connects all hands to the engine. `page` has help(), fold(), letters() and pixel(): where the drill is on the
/// screen, or nothing where that is not known.
export function makeHand(canvas, spindleButton, pushButtons, engine, page) {
  const held = new Set(); // keys and buttons that act as long as they are down
  const fingers = new Map(), pointers = new Map(); // of touch; of mouse and pen
  let cursor = null; // where the drill was moved to last [the engine's pixels]
  let entered = false, lastTap = null, lastTouch = matchMedia("(pointer: coarse)").matches, spindleDown = false;

  const ratio = () => canvas.width / Math.max(1, canvas.clientWidth);
  const at = (e) => {
    const box = canvas.getBoundingClientRect();
    return { x: (e.clientX - box.left) * ratio(), y: (e.clientY - box.top) * ratio() };
  };
  const spindle = (on) => {
    spindleDown = on;
    engine.spindle(on ? 1 : 0);
  };
  const stop = () => {
    held.clear();
    fingers.clear();
    spindle(false);
  };
  const moveTo = (p) => {
    cursor = { x: Math.min(Math.max(p.x, 0), canvas.width), y: Math.min(Math.max(p.y, 0), canvas.height) };
    engine.move(cursor.x, cursor.y);
  };
  const moveBy = (dx, dy) => {
    cursor ??= page.pixel() ?? { x: canvas.width / 2, y: canvas.height / 2 };
    moveTo({ x: cursor.x + dx, y: cursor.y + dy });
  };
  /// The view or the drill moves by itself, so that the cursor must be found anew.
  const lose = () => (cursor = null);
  const orbit = (dx, dy) => {
    engine.orbit(dx, dy);
    lose();
  };
  const act = (name) => {
    engine.act(name);
    lose();
  };

  // Mouse and pen, as the native window takes them.
  function onMove(e) {
    lastTouch = e.pointerType !== "mouse";
    const p = at(e), before = pointers.get(e.pointerId) ?? p;
    const dx = p.x - before.x, dy = p.y - before.y;
    pointers.set(e.pointerId, p);
    engine.mouse_at(p.x, p.y);
    if (!entered) return void (entered = true);
    if (e.buttons & 4) {
      if (e.shiftKey) engine.pan(dx, dy);
      else engine.orbit(dx, dy);
      return lose();
    }
    if (e.pointerType === "pen") {
      const presses = e.pressure >= kPenPressure && !(e.buttons & 2);
      if (presses !== spindleDown) spindle(presses);
    }
    if (e.buttons & 2) engine.push((-kDragStep * dy) / ratio());
    else if (e.ctrlKey || e.metaKey) engine.turn(dx, dy);
    else moveTo(p);
  }
  function onButtons(e) {
    const left = e.pointerType === "mouse" && (e.buttons & 1) !== 0;
    if (e.pointerType === "mouse" && e.button === 0 && left !== spindleDown) spindle(left);
  }

  // Fingers: one moves the drill by its own motion, so that it hides nothing; two turn the view.
  function onTouch(e) {
    const p = at(e), before = fingers.get(e.pointerId);
    if (!before) return;
    const others = [...fingers].filter(([id]) => id !== e.pointerId).map(([, f]) => f);
    fingers.set(e.pointerId, { ...before, ...p, far: before.far || Math.hypot(p.x - before.x0, p.y - before.y0) > kTapReach * ratio() });
    if (others.length === 0) return before.viewed ? undefined : moveBy(p.x - before.x, p.y - before.y);
    if (others.length > 1) return;
    const other = others[0];
    orbit((p.x - before.x) / 2, (p.y - before.y) / 2);
    const was = Math.hypot(before.x - other.x, before.y - other.y), is = Math.hypot(p.x - other.x, p.y - other.y);
    if (was > 10 && is > 10) engine.zoom(Math.log(is / was) / kNotch);
  }
  function onTouchUp(e) {
    const f = fingers.get(e.pointerId);
    fingers.delete(e.pointerId);
    if (!f || f.far || f.viewed || e.timeStamp - f.t0 > kTap) return;
    const near = lastTap && e.timeStamp - lastTap.t < kTwoTaps + kTap && Math.hypot(f.x - lastTap.x, f.y - lastTap.y) < 2 * kTapReach * ratio();
    if (near) {
      engine.mouse_at(f.x, f.y);
      act("T");
    }
    lastTap = near ? null : { t: e.timeStamp, x: f.x, y: f.y };
  }

  canvas.addEventListener("pointerdown", (e) => {
    canvas.focus({ preventScroll: true });
    lastTouch = e.pointerType !== "mouse";
    canvas.setPointerCapture(e.pointerId);
    const p = at(e);
    if (e.pointerType !== "touch") {
      pointers.set(e.pointerId, p);
      return onButtons(e);
    }
    fingers.set(e.pointerId, { ...p, x0: p.x, y0: p.y, t0: e.timeStamp, far: false, viewed: false });
    if (fingers.size > 1) for (const f of fingers.values()) f.viewed = true;
  });
  canvas.addEventListener("pointermove", (e) => {
    if (e.pointerType === "touch") return onTouch(e);
    // Buttons beyond the first that go down or up are told as moves.
    onButtons(e);
    onMove(e);
  });
  canvas.addEventListener("pointerup", (e) => {
    if (e.pointerType === "touch") return onTouchUp(e);
    if (e.pointerType === "pen") spindle(false);
    onButtons(e);
  });
  canvas.addEventListener("pointercancel", stop);
  canvas.addEventListener("pointerleave", (e) => {
    if (e.pointerType === "touch") return;
    entered = false;
    pointers.delete(e.pointerId);
  });
  canvas.addEventListener("contextmenu", (e) => e.preventDefault());
  canvas.addEventListener("mousedown", (e) => e.button === 1 && e.preventDefault()); // no scrolling by the middle button
  canvas.addEventListener("auxclick", (e) => e.preventDefault());
  canvas.addEventListener("wheel", (e) => {
    e.preventDefault();
    const way = e.deltaY || e.deltaX;
    const notches = -way / (e.deltaMode === 1 ? 3 : e.deltaMode === 2 ? 1 : kPixelsPerNotch);
    // A pinch on a touchpad is told as a wheel with Ctrl.
    if (e.shiftKey || e.ctrlKey) {
      engine.zoom(e.ctrlKey ? 4 * notches : notches);
      lose();
    } else engine.push(kWheelStep * notches);
  }, { passive: false });

  // Buttons on the screen: held, or pressed by a key or a screen reader.
  let pressedAt = 0, wasOn = false, byPointer = false;
  spindleButton.addEventListener("pointerdown", (e) => {
    if (e.button !== 0) return;
    spindleButton.setPointerCapture(e.pointerId);
    [pressedAt, wasOn, byPointer] = [e.timeStamp, page.spindle(), true];
    lastTouch = e.pointerType !== "mouse";
    spindle(true);
  });
  spindleButton.addEventListener("pointerup", (e) => {
    if (byPointer) spindle(e.timeStamp - pressedAt < kTap && !wasOn);
  });
  spindleButton.addEventListener("click", () => {
    if (!byPointer) spindle(!page.spindle());
    byPointer = false;
  });
  for (const [button, way] of pushButtons) {
    const name = `push ${way}`;
    let pointer = false;
    const end = () => held.delete(name);
    button.addEventListener("pointerdown", (e) => {
      if (e.button !== 0) return;
      button.setPointerCapture(e.pointerId);
      lastTouch = e.pointerType !== "mouse";
      pointer = true;
      held.add(name);
    });
    button.addEventListener("pointerup", end);
    button.addEventListener("lostpointercapture", end);
    button.addEventListener("click", () => {
      if (!pointer) engine.push(way * kWheelStep);
      pointer = false;
    });
  }
  for (const button of [spindleButton, ...pushButtons.map(([b]) => b)]) {
    button.addEventListener("pointercancel", stop);
    button.addEventListener("contextmenu", (e) => e.preventDefault());
  }

  // Keys. A control that has the focus keeps the keys that it needs.
  const kOwnKeys = { BUTTON: /^( |Enter)$/, SUMMARY: /^( |Enter)$/, INPUT: /^( |Enter|Arrow.*|[-0-9.+]|Backspace|Page.*)$/, SELECT: /^(?!F1$|Escape$)/ };
  addEventListener("keydown", (e) => {
    if (document.querySelector("dialog[open]")) return;
    if (e.key === "F1" && !e.altKey) {
      e.preventDefault();
      return page.help();
    }
    if (e.key === "Escape") return stop();
    if (kOwnKeys[e.target.tagName]?.test(e.key)) return;
    if (/^(Arrow|Page)/.test(e.key)) {
      if (e.altKey || e.metaKey) return;
      if (/^Page/.test(e.key) && !held.has(e.key)) engine.push((e.key === "PageUp" ? 1 : -1) * kWheelStep);
      held.add(e.key);
      for (const [key, down] of [["Shift", e.shiftKey], ["Control", e.ctrlKey]]) down ? held.add(key) : held.delete(key);
      return e.preventDefault();
    }
    if (e.key === "Shift" || e.key === "Control") return void held.add(e.key);
    if (e.ctrlKey || e.altKey || e.metaKey) return;
    const name = kNames[e.key] ?? (e.key.length === 1 ? e.key.toUpperCase() : e.key);
    if (name.length === 1 && !page.letters()) return;
    if (name === "P") return page.fold();
    if (name === "?") return page.help();
    if (!page.acts(name) || (e.repeat && !kRepeats.has(name))) return;
    e.preventDefault();
    act(name);
  });
  addEventListener("keyup", (e) => held.delete(e.key));

  // Nobody hears a release without the focus, so the spindle must not go on turning.
  addEventListener("blur", stop);
  document.addEventListener("visibilitychange", () => document.hidden && stop());
  addEventListener("pagehide", stop);

  function keys(dt) {
    const x = (held.has("ArrowRight") ? 1 : 0) - (held.has("ArrowLeft") ? 1 : 0);
    const y = (held.has("ArrowDown") ? 1 : 0) - (held.has("ArrowUp") ? 1 : 0);
    if (x !== 0 || y !== 0) {
      const turn = kTurnSpeed * dt * ratio(), move = kMoveSpeed * dt * ratio();
      if (held.has("Shift")) orbit(turn * x, turn * y);
      else if (held.has("Control")) engine.turn(turn * x, turn * y);
      else moveBy(move * x, move * y);
    }
    const push = (held.has("PageUp") || held.has("push 1") ? 1 : 0) - (held.has("PageDown") || held.has("push -1") ? 1 : 0);
    if (push !== 0) engine.push(push * kPushSpeed * dt);
  }

  const pad = { trigger: false, smaller: false, larger: false };
  function gamepad(dt) {
    const g = [...(navigator.getGamepads?.() ?? [])].find((p) => p?.connected && p.mapping === "standard");
    if (!g) return;
    const stick = (i) => (Math.abs(g.axes[i] ?? 0) > kDead ? g.axes[i] : 0), down = (i) => g.buttons[i]?.pressed ?? false;
    const move = 2 * kMoveSpeed * dt * ratio(), turn = kTurnSpeed * dt * ratio();
    if (stick(0) || stick(1)) moveBy(move * stick(0), move * stick(1));
    if (stick(3)) engine.push(-2 * kPushSpeed * dt * stick(3));
    const x = (down(15) ? 1 : 0) - (down(14) ? 1 : 0), y = (down(13) ? 1 : 0) - (down(12) ? 1 : 0);
    if (x || y) orbit(turn * x, turn * y);
    const trigger = (g.buttons[7]?.value ?? 0) > 0.3;
    if (trigger !== pad.trigger) spindle((pad.trigger = trigger));
    for (const [name, button, key] of [["smaller", 4, "["], ["larger", 5, "]"]]) {
      if (down(button) && !pad[name]) act(key);
      pad[name] = down(button);
    }
  }

  return {
    /// What is held acts for `dt` seconds.
    frame(dt) {
      if (document.querySelector("dialog[open]")) return;
      keys(dt);
      gamepad(dt);
    },
    stop,
    lose,
    touch: () => lastTouch,
  };
}
