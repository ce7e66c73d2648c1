// Keyboard, gamepad, touch stick and pointer: what is held goes to the server, what is pressed is done.

const DRAG = 0.006; // radians a pixel
const TAP = 5; // pixels that a finger may move and still only tap
const ORBIT_RATE = 2.5, DEAD_ZONE = 0.18, TRIGGER_HELD = 0.35;
const BUTTONS = (
  "a b x y leftshoulder rightshoulder lefttrigger righttrigger back start leftstick rightstick " +
  "dpad_up dpad_down dpad_left dpad_right"
).split(" ");
const REPEATED = new Set("stronger weaker style_next style_previous zoom_in zoom_out".split(" "));
const NAMES = {
  " ": "space", ArrowUp: "up", ArrowDown: "down", ArrowLeft: "left", ArrowRight: "right", Enter: "return",
  PageUp: "page up", PageDown: "page down",
};
const CODES = { ShiftLeft: "left shift", ShiftRight: "right shift", NumpadEnter: "keypad enter",
  NumpadSubtract: "keypad -", NumpadAdd: "keypad +" };

export class Input {
  // act: does an action; send: tells the server what is held.
  constructor(canvas, world, camera, { act, send, tap }) {
    Object.assign(this, { camera, act, send, tap });
    this.keys = lookup(world.keys);
    this.pad = lookup(world.pad);
    this.held = new Set(world.held); // actions that count while they are held
    this.down = new Map(); // key, button or pad control that is down -> its action
    this.touched = [0, 0]; // of the touch stick
    this.number = 0;
    this.last = "";
    this.sent = new Map(); // number of an input that no frame has answered -> when its event came
    this.padDown = new Set();
    addEventListener("keydown", (event) => this.keyDown(event));
    addEventListener("keyup", (event) => this.release(event.code, event.timeStamp));
    addEventListener("blur", () => this.letGo());
    this.listen(canvas);
  }

  keyDown(event) {
    if (event.target.matches("input[type=search], input[type=text]")) return;
    const ctrl = event.ctrlKey || event.metaKey || event.altKey ? "ctrl+" : "", name = keyName(event);
    const action = this.keys[ctrl + (event.shiftKey ? "shift+" : "") + name] ?? this.keys[ctrl + name];
    if (!action) return;
    event.preventDefault();
    if (event.repeat && !REPEATED.has(action)) return;
    this.press(event.code, action, event.timeStamp);
  }

  press(control, action, when) {
    if (this.held.has(action)) this.down.set(control, action);
    else this.act(action);
    this.sendHeld(when);
  }

  release(control, when) {
    if (this.down.delete(control)) this.sendHeld(when);
  }

  letGo() {
    this.down.clear();
    this.touched = [0, 0];
    this.sendHeld();
  }

  // Tells the server what is held and where the camera looks, if that has changed; when: the event came.
  sendHeld(when = performance.now()) {
    const round = (value) => Math.round(value * 1e4) / 1e4;
    const said = {
      held: [...new Set(this.down.values())].sort(),
      stick: (this.padStick ?? this.touched).map(round),
      look: (this.padLook ?? [0, 0]).map(round),
      yaw: round(this.camera.yaw),
    };
    const text = JSON.stringify(said);
    if (text === this.last) return;
    this.last = text;
    this.number += 1;
    if (this.send({ n: this.number, ...said })) this.sent.set(this.number, when);
  }

  // Milliseconds since the event of the newest input that the server has answered, once for each.
  answered(number) {
    const at = this.sent.get(number);
    for (const key of this.sent.keys()) if (key <= number) this.sent.delete(key);
    return at === undefined ? null : performance.now() - at;
  }

  // Once a picture: the gamepad, which has no events, and the camera's turn.
  step(seconds) {
    const pad = [...(navigator.getGamepads?.() ?? [])].find((each) => each?.connected && each.mapping === "standard");
    this.padStick = this.padLook = null;
    if (pad) this.readPad(pad, seconds);
    else this.letGoPad();
    this.sendHeld();
  }

  readPad(pad, seconds) {
    const shifted = pad.buttons[6].value > TRIGGER_HELD;
    pad.buttons.forEach((button, i) => {
      const control = `pad ${i}`, name = BUTTONS[i], on = button.pressed || button.value > TRIGGER_HELD;
      if (on && !this.padDown.has(control)) {
        const action = (shifted && this.pad[`lefttrigger+${name}`]) || this.pad[name];
        if (action) this.press(control, action);
      }
      if (!on) this.release(control);
      on ? this.padDown.add(control) : this.padDown.delete(control);
    });
    const stick = (i) => {
      const [x, y] = [pad.axes[i], -pad.axes[i + 1]];
      return Math.hypot(x, y) > DEAD_ZONE ? [x, y] : null;
    };
    for (const [name, axis] of [["left stick", 0], ["right stick", 2]]) {
      const action = (shifted && this.pad[`lefttrigger+${name}`]) || this.pad[name], at = stick(axis);
      if (!at) continue;
      if (action === "walk") this.padStick = at;
      else if (action === "face") this.padLook = at;
      else if (action === "orbit") this.camera.orbit(-at[0] * ORBIT_RATE * seconds, -at[1] * ORBIT_RATE * seconds);
    }
  }

  // It is unplugged: nothing on it is held any more.
  letGoPad() {
    for (const control of this.padDown) this.release(control);
    this.padDown.clear();
  }

  // ---- pointers on the picture: drag to orbit, pinch or wheel to zoom, tap to pick ---------------

  listen(canvas) {
    const fingers = new Map();
    let moved = 0;
    canvas.addEventListener("pointerdown", (event) => {
      document.activeElement?.blur();
      canvas.setPointerCapture(event.pointerId);
      if (!fingers.size) moved = 0;
      fingers.set(event.pointerId, [event.clientX, event.clientY]);
    });
    canvas.addEventListener("pointermove", (event) => {
      const before = fingers.get(event.pointerId);
      if (!before) return;
      const now = [event.clientX, event.clientY], [dx, dy] = [now[0] - before[0], now[1] - before[1]];
      moved += Math.hypot(dx, dy);
      if (fingers.size === 1) this.camera.orbit(-dx * DRAG, dy * DRAG);
      else {
        const other = [...fingers.entries()].find(([id]) => id !== event.pointerId)[1];
        const span = (at) => Math.hypot(at[0] - other[0], at[1] - other[1]);
        this.camera.zoom(Math.log(span(now) / Math.max(span(before), 1)) / Math.log(1 / 0.9));
      }
      fingers.set(event.pointerId, now);
    });
    const end = (event) => {
      if (fingers.delete(event.pointerId) && event.type === "pointerup" && moved < TAP)
        this.tap(event.clientX, event.clientY);
    };
    for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, end);
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.camera.zoom(-Math.sign(event.deltaY));
    }, { passive: false });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  }

  // A stick under the thumb: a disc with a knob.
  listenStick(disc) {
    const knob = disc.firstElementChild;
    const move = (event) => {
      const box = disc.getBoundingClientRect(), reach = box.width / 2;
      let at = [(event.clientX - box.left) / reach - 1, 1 - (event.clientY - box.top) / reach];
      const length = Math.max(1, Math.hypot(...at));
      at = at.map((share) => share / length);
      this.touched = at;
      knob.style.transform = `translate(${at[0] * 34}px, ${-at[1] * 34}px)`;
      this.sendHeld(event.timeStamp);
    };
    const end = (event) => {
      this.touched = [0, 0];
      knob.style.transform = "";
      this.sendHeld(event.timeStamp);
    };
    disc.addEventListener("pointerdown", (event) => {
      disc.setPointerCapture(event.pointerId);
      move(event);
    });
    disc.addEventListener("pointermove", (event) => disc.hasPointerCapture(event.pointerId) && move(event));
    for (const kind of ["pointerup", "pointercancel"]) disc.addEventListener(kind, end);
  }

  // A button that holds its action as long as it is pressed.
  listenHold(button, action) {
    button.addEventListener("pointerdown", (event) => {
      button.setPointerCapture(event.pointerId);
      this.press(button, action, event.timeStamp);
    });
    for (const kind of ["pointerup", "pointercancel"]) button.addEventListener(kind, (event) => this.release(button, event.timeStamp));
    button.addEventListener("contextmenu", (event) => event.preventDefault());
  }
}

function keyName(event) {
  if (CODES[event.code]) return CODES[event.code];
  const digit = event.code.match(/^Digit(\d)$/);
  return digit ? digit[1] : NAMES[event.key] ?? event.key.toLowerCase();
}

function lookup(table) {
  return Object.fromEntries(Object.entries(table).flatMap(([action, names]) => names.map((name) => [name, action])));
}
