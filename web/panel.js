// Sliders of a pose and a choice of gait, for bodies that take them by command.
import { clamp } from "./legs.js";
import { pacedGait } from "./pace.js";

const STEP = 0.01; // of a slider, standing heights or rad

export class Panel {
  // Takes an element with a place for sliders, a list of gaits, a slider of the frequency and a button.
  constructor(element) {
    this.element = element;
    this.place = element.querySelector(".sliders");
    this.list = element.querySelector("select");
    [this.tempo, this.hertz] = element.querySelectorAll("input, output");
    element.querySelector("button").addEventListener("click", () => this.reset());
    this.list.addEventListener("change", () => this.list.blur());
    // What a pointer has moved or pressed gives the keys back.
    element.addEventListener("pointerup", ({ target }) => target.closest("input, button, summary")?.blur());
  }

  // Offers the poses and gaits of a body, or nothing to one that has none.
  offer(direction) {
    this.direction = direction;
    this.element.hidden = !direction;
    this.list.replaceChildren(...Object.keys(direction?.gaits ?? {}).map((name) => new Option(name)));
    this.sliders = (direction?.names ?? []).map((name, i) => slider(name, direction.room[i]));
    this.place.replaceChildren(...this.sliders.map(({ label }) => label));
    this.reset();
  }

  reset() {
    for (const { input } of this.sliders) input.value = 0;
    this.list.selectedIndex = 0;
    this.tempo.value = 1;
  }

  // Chooses a gait by its number; the body's own is 0.
  choose(number) {
    if (number < this.list.length) this.list.selectedIndex = number;
  }

  // Name of the gait, unless it is the body's own.
  get gait() {
    return this.list.selectedIndex > 0 ? this.list.value : "";
  }

  // Makes steps quicker or slower, by a sign.
  quicken(sign) {
    this.tempo.stepUp(sign);
  }

  // The command, the pose of sliders and of keys that are held, shares of the room from -1 to 1, and the gait, which
  // suits the speed; a run, which not all bodies have, is faster ahead.
  asked(command, shares, runs = false) {
    if (!this.direction) return { command };
    const { room, run } = this.direction;
    const sought = room.map(([low, high], i) => {
      const held = shares[i] * (shares[i] < 0 ? -low : high);
      return clamp(Number(this.sliders[i].input.value) + held, low, high);
    });
    // Not all numbers at their bounds at once.
    const used = sought.reduce((sum, value, i) => sum + (value && value / room[i][value < 0 ? 0 : 1]), 0);
    const pose = sought.map((value) => value / Math.max(used, 1));
    const [forward, ...others] = command;
    const going = [runs && run && forward > 0 ? run * forward : forward, ...others];
    const gait = pacedGait(this.direction, going, this.list.value, this.tempo.value);
    return { command: going, pose, gait };
  }

  // Shows the numbers of a pose and a gait.
  tell({ pose, gait }) {
    this.sliders.forEach(({ output }, i) => (output.value = pose[i].toFixed(2)));
    if (gait) this.hertz.value = `${gait.at(-1).toFixed(1)} Hz`;
  }
}

function slider(name, [min, max]) {
  const label = document.createElement("label"), input = document.createElement("input");
  const output = document.createElement("output");
  Object.assign(input, { type: "range", min, max, step: STEP, disabled: min === max });
  label.append(name, input, output);
  return { label, input, output };
}
