import { clamp } from "./legs.js";

// Commands [forward, left, turning] of a velocity.
const LEAST = [-0.5, -0.5, -1], MOST = [1, 0.5, 1]; // as the tasks draw them

// A command within what tasks ask for: the sum of speed and turning is at most 1.
export function bounded(command) {
  const within = command.map((value, i) => clamp(value, LEAST[i], MOST[i]));
  const size = Math.hypot(within[0], within[1]) + Math.abs(within[2]);
  return within.map((value) => value / Math.max(size, 1) + 0);
}
