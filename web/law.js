// The law `Stepping`, as arc_suite.cpg.stepping defines it, with constants that Python computed.
import { clamp, moved, reached, relaxed, tilt, vertical, verticalAbout, weighing } from "./legs.js";
import { paceUnder } from "./pace.js";

const share = (value) => value - Math.floor(value); // of a cycle

export class Law {
  constructor(constants) {
    this.constants = constants;
    this.begin();
  }

  begin() {
    this.leap = null; // the targets of a leap that are left, first those of this control step
    const zero = [0, 0, 0], angles = this.constants.legs.map((leg) => leg.angles);
    this.state = { command: zero, integral: zero, motion: zero, size: 0, angles, off: zero, raised: 1 };
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
  walked({ posture, velocities, command, gait_clock: clock, pose, gait }) {
    const c = this.constants, state = this.state;
    const going = clock[0] !== 0 || clock[1] !== 0;
    const asked = command.slice(0, 3), motion = command.slice(3);
    const smooth = state.command.map((value, i) => value + c.smoothing * (asked[i] - value));
    const errors = smooth.map((value, i) => value - motion[i]), gained = state.size >= 1 ? c.integral : 0;
    const integral = state.integral.map((value, i) => (going ? clamp(value + gained * errors[i], -1, 1) : 0));
    const size = clamp(state.size + (going ? c.onset : -c.onset), 0, 1);
    const requested = going
      ? smooth.map((value, i) => value + integral[i] + c.gain[i] * errors[i])
      : state.motion;
    const up = vertical(posture.slice(1, 5)), { off, posed } = this.corrected(pose, posture[0], up);
    const balance = this.balanced(verticalAbout(up, pose.slice(3)), asked, velocities);
    const raised = this.raised(asked);
    const angles = this.planned(requested, size, going, gait, posed, balance, raised);
    this.state = { command: smooth, integral, motion: requested, size, angles, off, raised };
    return [this.byJoint(state.angles), this.byJoint(angles)];
  }

  // The multiple of the height of steps, which goes over to that of the command's pace.
  raised(asked) {
    const { paces, smoothing } = this.constants, { raised } = this.state;
    return paces ? raised + smoothing * (paceUnder(paces, asked).height - raised) : raised;
  }

  // The share of the request at which a torso that tilts walks on, and the shift of footholds, m.
  balanced(up, asked, velocities) {
    const c = this.constants, slowed = clamp(2 - Math.hypot(up[0], up[1]) / c.slowing_tilt, 0, 1);
    const shift = [0, 1].map((i) => c.capture * (velocities[i] - asked[i] * c.units[i]) - c.lean * up[i]);
    return { slowed, shift };
  }

  // The integral of the error of height, roll and pitch, and the pose that makes up for it.
  corrected(pose, height, up) {
    const c = this.constants, shown = [height / c.height - c.ride, ...tilt(up)];
    const errors = [0, 3, 4].map((number, i) => clamp(pose[number] - shown[i], -c.largest, c.largest));
    const off = errors.map((error, i) => clamp(this.state.off[i] + c.integral * error, -c.most_off, c.most_off));
    const [rise, roll, pitch] = off.map((value, i) => value + c.proportional * errors[i]);
    return { off, posed: [rise, 0, 0, roll, pitch, 0].map((value, i) => pose[i] + value) };
  }

  // Angles of the links of each leg, rad, that bring the soles where they are to be in the next control step.
  planned(requested, size, going, gait, posed, { slowed, shift }, raised) {
    const c = this.constants, count = c.legs.length;
    const [forward, left, turn] = requested.map((value, i) => slowed * clamp(value, -c.most, c.most) * c.units[i]);
    const [duty, rate] = gait.slice(2 * count), frequency = rate * c.rate, time = (0.5 * duty) / frequency;
    const flows = c.legs.map(({ place: [x, y] }) => [forward - turn * y, left + turn * x]);
    // No foot steps so far that legs would pass through each other.
    const longest = Math.max(1e-9, ...flows.map((flow) => time * Math.hypot(...flow)));
    const half = time * Math.min(1, c.longest / longest);
    return c.legs.map((leg, index) => {
      const z = leg.place[2], flow = flows[index];
      const phase = Math.atan2(gait[index], gait[count + index]) / (2 * Math.PI);
      const cycle = share(phase + c.lead + (going ? frequency * c.step : 0));
      const stands = cycle < duty, swung = stands ? 0 : (cycle - duty) / (1 - duty);
      const along = stands ? 1 - (2 * cycle) / duty : 2 * swung - 1;
      const shifted = c.take_off_share + (1 - c.take_off_share) * 0.5 * (1 + along);
      const ground = [0, 1].map((i) => leg.place[i] + size * (along * half * flow[i] + shifted * shift[i]));
      const lift = size * raised * c.lift * Math.sin(Math.PI * swung);
      const goal = moved([...ground, z + lift], posed, c.height);
      const weights = weighing(flow, c.across);
      const angles = reached(leg, this.state.angles[index], goal, weights, c.damping_of_feet, c.steps);
      return relaxed(leg, angles, c.relaxing_share, c.relaxing_damping);
    });
  }

  byJoint(angles) {
    return this.constants.legs.flatMap(({ moves }, index) => angles[index].filter((_, link) => moves[link]));
  }
}
