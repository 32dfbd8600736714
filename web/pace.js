// How a body goes at a speed, as arc_suite.robots.gaits defines it: the faster, the quicker steps and the shorter stances.
import { clamp } from "./legs.js";

// Takes paces [speed, tempo, change of the duty factor, height of steps] by rising speed, and a command [forward, left,
// turning].
export function paceUnder(paces, [forward, left, turn]) {
  if (forward <= 0) return { tempo: 1, change: 0, height: 1 };
  const speeds = paces.map(([speed]) => speed), size = forward + Math.abs(left) + Math.abs(turn);
  const speed = clamp(size, speeds[0], speeds.at(-1));
  const next = Math.max(speeds.findIndex((bound) => bound >= speed), 1);
  const share = (speed - speeds[next - 1]) / (speeds[next] - speeds[next - 1]);
  const [tempo, change, height] = [1, 2, 3].map((i) => paces[next - 1][i] + share * (paces[next][i] - paces[next - 1][i]));
  return { tempo, change, height };
}

// The gait of a body under a command, by its name and a multiple of its frequency; it takes the choices of a page's data.
export function pacedGait({ gaits, frequency, paces }, command, name = "own", quickness = 1) {
  const { tempo, change } = paceUnder(paces, command), [...offsets] = gaits[name], duty = offsets.pop();
  return [...offsets, duty + change, frequency * quickness * tempo];
}
