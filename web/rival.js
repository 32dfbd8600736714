// A rival that walks up to the player's body and pushes it out of a ring.
import { bounded } from "./command.js";
import { clamp, wrapped } from "./legs.js";
import { pacedGait } from "./pace.js";

const SPEED = 0.9, TURNING = 1.5; // forward, and turning for each rad that it is off
const AHEAD = 0.6; // rad, within which it walks ahead
const BEYOND = 0.6; // reaches behind the player's body, outwards from the ring's center, to the point where it aims
const NEAR = 1.9, FREE = 2.2; // reaches between the bodies: where it has no room to turn, and where it has
const OFF = 0.45, STRAIGHT = 0.15; // rad, from which it steps back where it is near, and within which it comes again
const POSE = [0, 0, 0, 0, 0, 0];
const LUNGE = 0.35, REST = 2; // share of the largest kick, as of a player who taps its key, and s between two lunges
const BLOCKED = 0.5; // of the command's unit: a rival that is slower lunges

export class Rival {
  // Takes a body of a page's data, and the ring's center [x, y], m.
  constructor({ reach, kick, task: { direction } }, center) {
    Object.assign(this, { reach, kick, direction, center, stepsBack: false, rest: REST });
  }

  // The commands of the rival at a place [x, y, heading], with the player's body at another.
  asked(place, other) {
    const { direction } = this, [forward, ...others] = this.command(place, other);
    const command = [forward > 0 ? forward * (direction?.run ?? 1) : forward, ...others];
    return { command, pose: POSE, gait: direction && pacedGait(direction, command) };
  }

  // It does not turn beside the other body, but steps back and comes again.
  command(place, other) {
    const angle = this.angle(place, other), off = Math.abs(angle), distance = this.distance(place, other);
    if (distance > FREE || off < STRAIGHT) this.stepsBack = false;
    else if (distance < NEAR && off > OFF) this.stepsBack = true;
    const ahead = off < AHEAD ? SPEED : 0;
    return bounded([this.stepsBack ? -1 : ahead, 0, clamp(TURNING * angle, -1, 1)]);
  }

  // The velocity [x, y] of a lunge at the end of some seconds, m/s, or null; it takes the mean velocity of the rival.
  lunge(seconds, place, other, [forward]) {
    this.rest = Math.max(this.rest - seconds, 0);
    const ready = this.distance(place, other) < NEAR && Math.abs(this.angle(place, other)) < OFF;
    if (!ready || this.rest || forward > BLOCKED) return null;
    this.rest = REST;
    return [Math.cos(place[2]), Math.sin(place[2])].map((value) => LUNGE * this.kick * value);
  }

  // Reaches between the bodies.
  distance([x, y], [otherX, otherY]) {
    return Math.hypot(otherX - x, otherY - y) / this.reach;
  }

  // How far the point where the rival aims is to its left, rad.
  angle([x, y, heading], other) {
    const out = this.center.map((value, i) => other[i] - value), size = Math.max(Math.hypot(...out), this.reach);
    const [aimX, aimY] = out.map((value, i) => other[i] + (BEYOND * this.reach * value) / size);
    return wrapped(Math.atan2(aimY - y, aimX - x) - heading);
  }
}
