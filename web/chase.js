// Keeps a camera behind a creature's heading, until the player turns it.
import { clamp, wrapped } from "./legs.js";

const RATE = 2.5; // 1/s, of the camera's way to its place
const RISES = [0.02, 1.4]; // rad, of the camera over its target
const TURNED = 1e-3; // rad, by which a player turns it at least: a wheel zooms

export class Chase {
  constructor(view) {
    this.view = view;
    this.on = true;
    this.dragged = null; // where the camera looked when a drag began, rad
    view.controls.addEventListener("start", () => (this.dragged = this.look));
    view.controls.addEventListener("end", () => {
      if (Math.abs(wrapped(this.look - this.dragged)) > TURNED) this.on = false;
      this.dragged = null;
    });
  }

  // The direction in which the camera looks, rad.
  get look() {
    const { target, camera: { position } } = this.view;
    return Math.atan2(target.y - position.y, target.x - position.x);
  }

  // Turns the camera about its target and raises it, rad.
  turn(angle, rise = 0) {
    const { target, camera: { position } } = this.view;
    const away = position.clone().sub(target), size = away.length();
    const azimuth = Math.atan2(away.y, away.x) + angle;
    const height = clamp(Math.asin(away.z / size) + rise, ...RISES);
    away.set(Math.cos(height) * Math.cos(azimuth), Math.cos(height) * Math.sin(azimuth), Math.sin(height));
    position.copy(target).addScaledVector(away, size);
    this.view.controls.update();
  }

  // Turns towards a heading, rad, for some seconds.
  follow(heading, seconds = Infinity) {
    if (this.on && this.dragged === null) this.turn(wrapped(heading - this.look) * (1 - Math.exp(-RATE * seconds)));
  }

  // Turns at the player's rates, rad/s.
  steer([turn, rise], seconds) {
    if (!turn && !rise) return;
    this.on = false;
    this.turn(turn * seconds, rise * seconds);
  }
}
