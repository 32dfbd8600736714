// What a task reads from the simulation and remembers, as arc_suite.tasks.command_task and walk define it; no reward.
import { Direction } from "./direction.js";

const TURN = 2 * Math.PI;

const wrapped = (angle) => angle + Math.PI - TURN * Math.floor((angle + Math.PI) / TURN) - Math.PI;

function yaw([w, x, y, z]) {
  return Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));
}

// An orientation turned by an angle about the vertical, rad.
export function turned([w, x, y, z], angle) {
  const cosine = Math.cos(0.5 * angle), sine = Math.sin(0.5 * angle);
  return [cosine * w - sine * z, cosine * x - sine * y, cosine * y + sine * x, cosine * z + sine * w];
}

// A vector of the world in the frame of a heading, rad: forward and left.
function headed(x, y, heading) {
  const cosine = Math.cos(heading), sine = Math.sin(heading);
  return [cosine * x + sine * y, cosine * y - sine * x];
}

function cross([ax, ay, az], [bx, by, bz]) {
  return [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx];
}

// The world's up axis in the frame of an orientation.
function vertical([w, x, y, z]) {
  return [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)];
}

// A vector of a frame in the world, given the orientation of the frame.
function rotated([w, x, y, z], vector) {
  const twice = cross([x, y, z], vector).map((value) => 2 * value), turn = cross([x, y, z], twice);
  return vector.map((value, i) => value + w * twice[i] + turn[i]);
}

// A body in a task. A task with a command observes in the frame of the torso's heading; one without a command, which
// walks along x, in the frame of a course, by which it is steered. Some take a pose and a gait, too.
export class Task {
  constructor(constants, ground) {
    this.constants = constants;
    this.ground = ground;
    this.desired = [0, 0, 0]; // command: forward, left and turning, in units of the body
    this.motion = [0, 0, 0]; // its mean velocity in the same units
    this.course = 0; // rad
    this.phase = 0; // of the gait, rad
    this.direction = constants.direction ? new Direction(constants.direction) : null;
    this.fell = false;
    this.alone = true; // whether nothing but the ground touches it
  }

  begin(data) {
    this.place = this.placed(data);
  }

  placed({ xpos, xquat, qpos }) {
    const { root } = this.constants;
    const [x, y] = this.torso(xpos.subarray(3 * root, 3 * root + 3), xquat.subarray(4 * root, 4 * root + 4));
    return [x, y, yaw(qpos.subarray(3, 7))];
  }

  // Returns the position of the torso, given the position and the orientation of its root body.
  torso([x, y, z], orientation) {
    const { torso_place: place } = this.constants;
    if (!place) return [x, y, z];
    const shift = rotated(orientation, place);
    return [x + shift[0], y + shift[1], z + shift[2]];
  }

  // Returns the velocity of the torso.
  velocity({ qpos, qvel }) {
    const { torso_place: place } = this.constants, velocity = qvel.subarray(0, 3);
    if (!place) return velocity;
    const swing = rotated(qpos.subarray(3, 7), cross(qvel.subarray(3, 6), place));
    return velocity.map((value, i) => value + swing[i]);
  }

  // Sets the commands of a control step: a velocity, from -1 to 1 each, a pose, and a gait.
  command(asked) {
    const { headed: commanded, units, step } = this.constants;
    this.asked = asked;
    this.desired = asked.command;
    if (!commanded) this.course += this.desired[2] * units[2] * step;
  }

  get going() {
    return !this.constants.headed || this.desired.some((value) => value !== 0);
  }

  // Takes the readings after a control step: clock, health, mean velocity.
  after(data) {
    const { turn, leak, units, step } = this.constants;
    const place = this.placed(data), [x, y, heading] = this.place;
    this.direction?.after(this.asked, this.going);
    if (this.going) this.phase = this.direction?.angle ?? (this.phase + turn) % TURN;
    const moved = [...headed(place[0] - x, place[1] - y, heading), wrapped(place[2] - heading)];
    this.motion = this.motion.map((value, i) => (1 - leak) * value + (leak * moved[i]) / (step * units[i]));
    this.place = place;
    this.fell = this.fallen(data);
  }

  fallen({ qpos, cfrc_ext: forces }) {
    const { lowest, lying, least_upright: least, weight, parts: [torso] } = this.constants;
    const high = this.height(qpos) >= lowest * (this.direction?.crouch ?? 1);
    const lies = this.alone && forces[6 * torso + 5] / weight >= lying; // others press on it, too
    return !high || lies || this.upright(qpos) < least;
  }

  // The cosine of the torso's tilt.
  upright(qpos) {
    const [, x, y] = qpos.subarray(3, 7);
    return 1 - 2 * (x * x + y * y);
  }

  height(qpos) {
    const [x, y, z] = this.torso(qpos, qpos.subarray(3, 7));
    return z - this.ground(x, y);
  }

  // Returns the blocks of an observation by name.
  observe(data) {
    const { headed: commanded, joints, dofs, home } = this.constants, { qpos, qvel } = data;
    const heading = commanded ? yaw(qpos.subarray(3, 7)) : this.course;
    const shown = this.going ? 1 : 0;
    const angles = joints.map((place, joint) => qpos[place] - home[joint]);
    const speeds = dofs.map((place) => qvel[place]), velocity = this.velocity(data);
    return {
      posture: [this.height(qpos), ...turned(qpos.subarray(3, 7), -heading), ...angles],
      velocities: [...headed(velocity[0], velocity[1], heading), velocity[2], ...qvel.subarray(3, 6), ...speeds],
      contact_forces: this.forces(data.cfrc_ext, heading),
      gait_clock: [shown * Math.sin(this.phase), shown * Math.cos(this.phase)],
      command: [...this.desired, ...this.motion],
      vertical: vertical(qpos.subarray(3, 7)),
      ...this.direction?.observe(),
    };
  }

  // Torque and force on each part, in units of the task, as a heading shows them.
  forces(forces, heading) {
    const { parts, force_unit: unit } = this.constants;
    return parts.flatMap((part) => {
      const force = Array.from(forces.subarray(6 * part, 6 * part + 6), (value, i) => value / unit[i]);
      const across = [0, 3].flatMap((i) => [...headed(force[i], force[i + 1], heading), force[i + 2]]);
      return across.map((value) => Math.min(Math.max(value, -1), 1));
    });
  }
}
