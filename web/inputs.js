// The player's command [forward, left, turning] and pose from keys, a gamepad, and a stick and buttons on the screen.
import { bounded } from "./command.js";
import { walks } from "./link.js";

const KEYS = {
  ArrowUp: [1, 0, 0], KeyW: [1, 0, 0],
  ArrowDown: [-1, 0, 0], KeyS: [-1, 0, 0],
  ArrowLeft: [0, 0, 1], KeyA: [0, 0, 1],
  ArrowRight: [0, 0, -1], KeyD: [0, 0, -1],
  KeyQ: [0, 1, 0], KeyE: [0, -1, 0],
};
// Height, forward, left, roll, pitch and yaw, shares of a body's room.
const POSES = {
  KeyC: [-1, 0, 0, 0, 0, 0], KeyV: [1, 0, 0, 0, 0, 0],
  KeyI: [0, 1, 0, 0, 0, 0], KeyK: [0, -1, 0, 0, 0, 0],
  KeyJ: [0, 0, 1, 0, 0, 0], KeyL: [0, 0, -1, 0, 0, 0],
  KeyF: [0, 0, 0, -1, 0, 0], KeyH: [0, 0, 0, 1, 0, 0],
  KeyT: [0, 0, 0, 0, -1, 0], KeyG: [0, 0, 0, 0, 1, 0],
  KeyZ: [0, 0, 0, 0, 0, 1], KeyX: [0, 0, 0, 0, 0, -1],
};
const RUNS = ["ShiftLeft", "ShiftRight"], PAD_RUNS = 10; // keys, and a gamepad's left stick that is pressed
const SHOWN = [0.8, 0, 0.2]; // a wide circle, where the page's address ends in #walk, until somebody plays
const BUTTONS = { 0: "kick", 1: "restart", 2: "leap", 9: "pause" }; // of a gamepad
const CAMERA = [-2.5, 1.2]; // rad/s, by the right stick
const DEAD = 0.15; // share of a gamepad's stick that counts as nothing

const sum = (vectors, zero) => vectors.reduce((total, vector) => total.map((value, i) => value + vector[i]), zero);

const live = (value = 0) => (Math.abs(value) > DEAD ? value : 0);

// Others have axes and buttons in places of their own, some of which rest at an end.
const gamepads = () => (navigator.getGamepads?.() ?? []).filter((pad) => pad?.connected && pad.mapping === "standard");
const values = ({ buttons }, ...numbers) => numbers.map((number) => buttons[number]?.value ?? 0);

// The left stick walks and turns, the cross steps to a side.
function commanded(pad) {
  const [left, right] = values(pad, 14, 15);
  return [-live(pad.axes[1]), left - right, -live(pad.axes[0])];
}

// Triggers crouch and rise, shoulder buttons lean, and the cross looks up and down.
function poses(pad) {
  const [left, right, crouch, rise, up, down] = values(pad, 4, 5, 6, 7, 12, 13);
  return [rise - crouch, 0, 0, right - left, down - up, 0];
}

export class Inputs {
  // Takes the element of the stick, whose first child is its knob, and the buttons for steps to the left and right.
  constructor(stick, sides) {
    this.held = new Set();
    this.stick = [0, 0, 0];
    this.side = [0, 0, 0];
    this.pushed = []; // buttons of a gamepad
    this.running = false; // by the button of the page
    this.shows = walks();
    window.addEventListener("keydown", (event) => {
      if (RUNS.includes(event.code)) this.held.add(event.code);
      if (!(event.code in KEYS || event.code in POSES) || event.ctrlKey || event.metaKey || event.altKey) return;
      const keyed = event.code.startsWith("Arrow") ? "select, input" : "select";
      if (event.target.closest(keyed)) return; // whose keys these are
      event.preventDefault();
      this.held.add(event.code);
    });
    window.addEventListener("keyup", (event) => this.held.delete(event.code));
    window.addEventListener("blur", () => this.held.clear()); // keys that are let go elsewhere
    this.follow(stick);
    sides.forEach((button, index) => {
      button.addEventListener("pointerdown", () => (this.side = [0, index ? -1 : 1, 0]));
      for (const end of ["pointerup", "pointercancel", "pointerleave"])
        button.addEventListener(end, () => (this.side = [0, 0, 0]));
    });
  }

  follow(stick) {
    const knob = stick.firstElementChild;
    const move = (across, up) => {
      this.stick = [up, 0, -across];
      knob.style.transform = `translate(${80 * across}%, ${-80 * up}%)`; // of its own size
    };
    const moved = ({ clientX, clientY }) => {
      const { left, top, width, height } = stick.getBoundingClientRect();
      const across = (2 * (clientX - left)) / width - 1, up = 1 - (2 * (clientY - top)) / height;
      const size = Math.max(1, Math.hypot(across, up));
      move(across / size, up / size);
    };
    stick.addEventListener("pointerdown", (event) => (stick.setPointerCapture(event.pointerId), moved(event)));
    stick.addEventListener("pointermove", (event) => stick.hasPointerCapture(event.pointerId) && moved(event));
    for (const end of ["pointerup", "pointercancel"]) stick.addEventListener(end, () => move(0, 0));
  }

  pressed(keys) {
    return [...this.held].filter((code) => code in keys).map((code) => keys[code]);
  }

  // Names of the actions whose buttons of a gamepad went down since the last question.
  pushes() {
    const before = this.pushed;
    this.pushed = Object.keys(BUTTONS).filter((number) => gamepads().some(({ buttons }) => buttons[number]?.pressed));
    return this.pushed.filter((number) => !before.includes(number)).map((number) => BUTTONS[number]);
  }

  // Whether a gamepad's button of an action is held.
  holds(action) {
    const [number] = Object.keys(BUTTONS).filter((each) => BUTTONS[each] === action);
    return gamepads().some(({ buttons }) => buttons[number]?.pressed);
  }

  get runs() {
    const pressed = gamepads().some(({ buttons }) => buttons[PAD_RUNS]?.pressed);
    return this.running || pressed || RUNS.some((code) => this.held.has(code));
  }

  // Rates at which the camera is to turn and rise, rad/s.
  get camera() {
    return sum(gamepads().map(({ axes }) => CAMERA.map((rate, i) => rate * live(axes[2 + i]))), [0, 0]);
  }

  get pose() {
    return sum([...this.pressed(POSES), ...gamepads().map(poses)], [0, 0, 0, 0, 0, 0]).map((value) =>
      Math.min(Math.max(value, -1), 1),
    );
  }

  get command() {
    const command = bounded(sum([...this.pressed(KEYS), ...gamepads().map(commanded), this.side], this.stick));
    if (command.some(Boolean)) this.shows = false;
    return this.shows ? SHOWN : command;
  }
}
