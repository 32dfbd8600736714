// Pose and gait by command, as arc_suite.tasks.direction defines them: both glide, and the clock counts integers.
import { clamp } from "./legs.js";

const CYCLE = 1 << 20; // units of the clock
const ANGLE = (2 * Math.PI) / CYCLE; // rad a unit
const DUTIES = [0.05, 0.95], FASTEST = 0.25; // cycles a control step

const modulo = (value) => ((value % CYCLE) + CYCLE) % CYCLE;
const nearer = (value, wanted, most) => value + clamp(wanted - value, -most, most);

// A gait of offsets, cycles, duty factor and frequency, Hz, in units of the clock.
function counted(gait, step) {
  const [duty, frequency] = gait.slice(-2);
  const shares = [...gait.slice(0, -2).map((offset) => offset - Math.floor(offset)), clamp(duty, ...DUTIES)];
  return [...shares, clamp(frequency * step, 1 / CYCLE, FASTEST)].map((value) => Math.round(CYCLE * value));
}

// A gait that is a control step nearer to another; offsets go the short way.
function glided(gait, wanted) {
  const most = Math.max(Math.floor(gait.at(-1) / 2), 1), half = CYCLE / 2;
  return gait.map((value, i) => {
    if (i >= gait.length - 2) return nearer(value, wanted[i], most);
    return modulo(nearer(value, value + modulo(wanted[i] - value + half) - half, most));
  });
}

export class Direction {
  constructor(constants) {
    this.constants = constants;
    this.pose = [0, 0, 0, 0, 0, 0];
    this.gait = counted([...constants.gaits.own, constants.frequency], constants.step);
    this.phase = 0; // of the gait, in units of the clock
  }

  // Takes a control step towards a pose and a gait, whose clock goes on unless the body is to stand.
  after({ pose, gait }, going) {
    const { glide, step } = this.constants;
    this.pose = this.pose.map((value, i) => nearer(value, pose[i], glide));
    this.gait = glided(this.gait, counted(gait, step));
    if (going) this.phase = (this.phase + this.gait.at(-1)) % CYCLE;
  }

  // Phase of the gait, rad.
  get angle() {
    return this.phase * ANGLE;
  }

  // The share of its height at rest that the torso is asked to keep.
  get crouch() {
    return Math.min(1 + this.pose[0], 1);
  }

  // Returns the blocks of an observation by name.
  observe() {
    const phases = this.gait.slice(0, -2).map((offset) => ((this.phase + offset) % CYCLE) * ANGLE);
    const [duty, advance] = this.gait.slice(-2).map((value) => value / CYCLE);
    const gait = [...phases.map(Math.sin), ...phases.map(Math.cos), duty, advance * this.constants.rate];
    return { pose: this.pose, gait };
  }
}
