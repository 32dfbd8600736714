// The law `Directed`, as arc_suite.cpg.stepping defines it, with constants that Python computed.
import { clamp, moved, reached, tilt, weighing } from "./legs.js";

const share = (value) => value - Math.floor(value); // of a cycle

export class Law {
  constructor(constants) {
    this.constants = constants;
    this.leap = null; // the targets of a leap that are left, first those of this control step
    this.begin();
  }

  begin() {
    const zero = [0, 0, 0], angles = this.constants.legs.map((leg) => leg.angles);
    this.state = { command: zero, integral: zero, motion: zero, size: 0, angles, off: zero };
  }

  // Plays a leap by its name, unless one goes on. Until the crouch ends, joints go over from where they are.
  play(name) {
    if (this.leap) return;
    const now = this.byJoint(this.state.angles);
    this.begin();
    const rest = this.byJoint(this.state.angles), { targets, crouched } = this.constants.leaps[name];
    this.leap = targets.map((angles, step) =>
      angles.map((angle, joint) => angle + Math.max(1 - step / crouched, 0) * (now[joint] - rest[joint])),
    );
  }

  // Returns actions of motors or servos for blocks of an observation, and remembers what the next step needs.
  act(observation) {
    const { posture, velocities } = observation, c = this.constants;
    const [targets, next] = this.leap ? this.leapt() : this.walked(observation);
    return targets.map((target, joint) => {
      const speed = (next[joint] - target) / c.step, stiffness = c.stiffness[joint], damping = c.damping[joint];
      if (c.reach) return clamp((target + (damping * speed) / stiffness) / c.reach[joint], -1, 1); // a servo's angle
      return clamp(stiffness * (target - posture[5 + joint]) - damping * (velocities[6 + joint] - speed), -1, 1);
    });
  }

  // Targets of a leap in this control step and in the next; after the last one the law begins anew.
  leapt() {
    const [targets, next] = this.leap;
    this.leap = this.leap.length > 2 ? this.leap.slice(1) : null;
    return [targets, next];
  }

  // Targets of the law in this control step and in the next.
  walked({ posture, command, gait_clock: clock, pose, gait }) {
    const c = this.constants, state = this.state;
    const going = clock[0] !== 0 || clock[1] !== 0;
    const asked = command.slice(0, 3), motion = command.slice(3);
    const smooth = state.command.map((value, i) => value + c.smoothing * (asked[i] - value));
    const integral = state.integral.map((value, i) =>
      going ? clamp(value + c.integral * (asked[i] - motion[i]), -1, 1) : 0,
    );
    const size = clamp(state.size + (going ? c.onset : -c.onset), 0, 1);
    const requested = going
      ? smooth.map((value, i) => value + integral[i] + c.gain[i] * (value - motion[i]))
      : state.motion;
    const { off, posed } = this.corrected(pose, posture);
    const angles = this.planned(requested, size, going, gait, posed);
    this.state = { command: smooth, integral, motion: requested, size, angles, off };
    return [this.byJoint(state.angles), this.byJoint(angles)];
  }

  // The integral of the error of height, roll and pitch, and the pose that makes up for it.
  corrected(pose, posture) {
    const c = this.constants, shown = [posture[0] / c.height - c.ride, ...tilt(posture.slice(1, 5))];
    const errors = [0, 3, 4].map((number, i) => clamp(pose[number] - shown[i], -c.largest, c.largest));
    const off = errors.map((error, i) => clamp(this.state.off[i] + c.integral * error, -c.most_off, c.most_off));
    const [rise, roll, pitch] = off.map((value, i) => value + c.proportional * errors[i]);
    return { off, posed: [rise, 0, 0, roll, pitch, 0].map((value, i) => pose[i] + value) };
  }

  // Angles of the links of each leg, rad, that bring the soles where they are to be in the next control step.
  planned(requested, size, going, gait, posed) {
    const c = this.constants, count = c.legs.length;
    const [forward, left, turn] = requested.map((value, i) => clamp(value, -c.most, c.most) * c.units[i]);
    const [duty, rate] = gait.slice(2 * count), frequency = rate * c.rate, half = (0.5 * duty) / frequency;
    return c.legs.map((leg, index) => {
      const [x, y, z] = leg.place, flow = [forward - turn * y, left + turn * x];
      const phase = Math.atan2(gait[index], gait[count + index]) / (2 * Math.PI);
      const cycle = share(phase + c.lead + (going ? frequency * c.step : 0));
      const stands = cycle < duty, swung = stands ? 0 : (cycle - duty) / (1 - duty);
      const along = stands ? 1 - (2 * cycle) / duty : 2 * swung - 1;
      const reach = size * along * half, lift = size * c.lift * Math.sin(Math.PI * swung);
      const goal = moved([x + reach * flow[0], y + reach * flow[1], z + lift], posed, c.height);
      return reached(leg, this.state.angles[index], goal, weighing(flow, c.across), c.damping_of_feet, c.steps);
    });
  }

  byJoint(angles) {
    return this.constants.legs.flatMap(({ moves }, index) => angles[index].filter((_, link) => moves[link]));
  }
}
