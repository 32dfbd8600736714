// Touchdowns of a body's feet, as a picture after another shows them.
import { clamp } from "./legs.js";

const DOWN = 0.05, UP = 0.01; // of the weight, on a foot that has touched down and on one that is to lift off
const LIFTED = 0.06; // s without load, after which a foot has lifted off: it may bounce
const NEAR = 0.1; // standing heights over the ground: what a foot touches higher up is no ground
const HARDEST = 0.3, LEAST = 0.2; // of a touchdown: sqrt(g h), and its share
const GRAVITY = 9.81; // m/s^2

export class Steps {
  // Takes a body of a page's data, and its parts as they are drawn.
  constructor({ feet, height, task }, parts) {
    Object.assign(this, { height, task, feet: feet.map(({ part, radius }) => ({ part, radius, drawn: parts[part] })) });
    this.fastest = HARDEST * Math.sqrt(GRAVITY * height);
    this.begin();
  }

  // All feet stand.
  begin() {
    for (const foot of this.feet) Object.assign(foot, { down: true, light: 0, place: null });
  }

  // Moves feet to where they are drawn; returns those that touched down, with strengths from 0 to 1.
  read({ data: { cfrc_ext: forces }, task: { ground }, pull }, seconds) {
    return this.feet.filter((foot) => {
      const [, , before] = foot.place ?? [0, 0, NaN], body = this.task.parts[foot.part];
      const [x, y, z] = (foot.place = foot.drawn.matrixWorld.elements.slice(12, 15));
      const load = pull?.body === body ? 0 : forces[6 * body + 5] / this.task.weight, stood = foot.down;
      foot.light = load > UP ? 0 : foot.light + seconds;
      foot.down = stood ? foot.light < LIFTED : load > DOWN;
      foot.strength = clamp((before - z) / seconds / this.fastest, LEAST, 1) || LEAST;
      return foot.down && !stood && z - foot.radius - ground(x, y) < NEAR * this.height;
    });
  }
}
