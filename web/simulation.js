// A body on some ground in MuJoCo's simulation, driven by a policy in a task; another one may stand before it.
import { Mind, doubled, shareOf } from "./mind.js";
import { Rival } from "./rival.js";
import { turned } from "./task.js";

const STIFFNESS = 4, STRONGEST = 3; // of a pull, in the body's weight for a distance of h, and at most
const GRAVITY = 9.81; // m/s^2
const LANDING = 0.6, TOUCH = 0.02; // s that a landing takes, share of the weight under a body that has touched down
const APART = 2.5; // reaches between two bodies
const CROUCH = 0.6; // of a body's room, as it lands
const AHEAD = 0.3; // of the command: a body that is to walk faster leaps, others jump
const STILL = { command: [0, 0, 0], pose: [0, 0, 0, 0, 0, 0] };

const dot = (first, second) => first.reduce((sum, value, index) => sum + value * second[index], 0);
const cross = ([a, b, c], [x, y, z]) => [b * z - c * y, c * x - a * z, a * y - b * x];

// Heights at the nodes of a grid, in rows along y. Two triangles meet in a cell from the corner of lowest to that of
// highest x and y.
export class Field {
  constructor({ low, cell, heights }) {
    Object.assign(this, { low, cell, heights, rows: heights.length, columns: heights[0].length });
    this.nodes = Float64Array.from(heights.flat());
  }

  // The height under a point, m; beyond the edge that of the edge.
  height(x, y) {
    const ends = [this.columns, this.rows];
    const place = [x, y].map((value, i) => Math.min(Math.max((value - this.low[i]) / this.cell[i], 0), ends[i] - 1));
    const [column, row] = place.map((value, i) => Math.min(Math.floor(value), ends[i] - 2));
    const u = place[0] - column, v = place[1] - row, right = u > v;
    const first = row * this.columns + column;
    const low = this.nodes[first], high = this.nodes[first + this.columns + 1];
    const corner = this.nodes[first + (right ? 1 : this.columns)];
    return low + (right ? u : v) * (corner - low) + (right ? v : u) * (high - corner);
  }
}

// The height field of a model, which lies around the start.
function fieldOf(model) {
  const [halfX, halfY, top] = model.hfield_size;
  const [rows, columns] = [model.hfield_nrow[0], model.hfield_ncol[0]];
  const nodes = Array.from(model.hfield_data, (share) => top * share);
  const heights = Array.from({ length: rows }, (_, row) => nodes.slice(row * columns, (row + 1) * columns));
  return new Field({ low: [-halfX, -halfY], cell: [(2 * halfX) / (columns - 1), (2 * halfY) / (rows - 1)], heights });
}

export class Simulation {
  // Takes the module of MuJoCo, a body of a page's data, one of its grounds, and how many bodies there are.
  constructor(mujoco, body, ground, count = 1) {
    this.mujoco = mujoco;
    this.body = body;
    this.model = mujoco.MjModel.from_xml_string(count > 1 ? doubled(ground.xml) : ground.xml);
    this.data = new mujoco.MjData(this.model);
    this.field = ground.surface ? new Field(ground.surface) : this.model.nhfield ? fieldOf(this.model) : null;
    this.start = ground.start;
    this.shares = Array.from({ length: count }, (_, number) => () => shareOf(this.data, number, count));
    this.pull = null; // of the player
    this.restart();
  }

  // Starts anew, from a pose and velocities that may be given; bodies are turned by angles, rad.
  restart(qpos = this.start, qvel = [], turns = [0, Math.PI]) {
    const { mujoco, model, data } = this;
    mujoco.mj_resetData(model, data);
    this.shares.forEach((share, number) => this.put(share(), qpos, number * APART * this.body.reach, turns[number]));
    data.qvel.set(qvel);
    mujoco.mj_forward(model, data);
    this.minds = this.shares.map((share) => this.mind(share));
    for (const { task } of this.minds) task.alone = this.minds.length === 1;
    this.rival = new Rival(this.body, this.center);
    this.count = 0; // substeps
    this.landing = 0; // s that are left; endless until a body that was let go touches the ground
  }

  // Puts a body in a pose, turned by an angle, rad, and moved along x, m.
  put({ qpos }, pose, along, angle) {
    qpos.set(pose);
    if (angle) qpos.set(turned(pose.slice(3, 7), angle), 3);
    if (!along) return;
    qpos[0] += along;
    qpos[2] += this.ground(qpos[0], qpos[1]);
  }

  mind(share) {
    return new Mind(this.body, (x, y) => this.ground(x, y), share);
  }

  // m
  ground(x, y) {
    return this.field ? this.field.height(x, y) : 0;
  }

  // The player's.
  get task() {
    return this.minds[0].task;
  }

  get driver() {
    return this.minds[0].driver;
  }

  // Takes one substep, at the start of a control step with a new action and the commands: a velocity [forward,
  // left, turning], and for some bodies a pose and a gait.
  substep(asked) {
    const { mujoco, model, data, task, minds: [own, rival], body: { substeps } } = this;
    if (this.count % substeps === 0) {
      own.act(() => this.allowed(asked));
      rival?.act(() => this.rival.asked(rival.task.place, own.task.place));
    }
    if (this.pull) this.drag(this.pull);
    mujoco.mj_step(model, data);
    this.count += 1;
    if (this.count % substeps !== 0) return;
    own.after(() => this.fell);
    rival?.after(() => rival.task.fell);
    if (rival && !rival.fell) this.lunge(rival.task);
    if (this.landing === Infinity && this.touches()) this.landing = LANDING;
    this.landing = Math.max(this.landing - task.constants.step, 0);
  }

  lunge({ constants: { step }, place, motion }) {
    const velocity = this.rival.lunge(step, place, this.task.place, motion);
    if (velocity) this.kick(velocity, 1);
  }

  // The commands that a body can follow: it leaps upright, and lands on bent legs.
  allowed(asked) {
    if (this.driver.leap) return { ...asked, ...STILL };
    if (!this.landing) return asked;
    const low = this.landing === Infinity ? 0 : CROUCH * (this.body.task.direction?.room[0][0] ?? 0);
    return { ...asked, ...STILL, pose: [low, 0, 0, 0, 0, 0] };
  }

  // [x, y] between the starts of two bodies, m
  get center() {
    return [0.5 * APART * this.body.reach, 0];
  }

  // Whether something holds the body up.
  touches() {
    const { data: { cfrc_ext: forces }, body: { task: { parts, weight } } } = this;
    return parts.some((part) => forces[6 * part + 5] > TOUCH * weight);
  }

  // Whether the body lies or gets up; neither in the player's hand nor on its way down from there.
  get fell() {
    return this.minds[0].fell && !this.pull && this.landing !== Infinity;
  }

  // Leaps ahead, or jumps where the body is slow; a body that can do only one of them does that.
  leap() {
    if (this.minds[0].rises) return;
    const leaps = this.body.policy.constants.leaps ?? {}, ahead = this.task.desired[0] > AHEAD;
    const [name] = (ahead ? ["leap", "jump"] : ["jump", "leap"]).filter((each) => leaps[each]);
    if (name) this.driver.play(name);
  }

  // Takes hold of a part at a point of the world, m.
  grab(part, point) {
    const { data, body: { task } } = this, body = task.parts[part];
    const turn = data.xmat.subarray(9 * body, 9 * body + 9);
    const arm = point.map((value, i) => value - data.xpos[3 * body + i]);
    const place = [0, 1, 2].map((i) => dot(arm, [turn[i], turn[3 + i], turn[6 + i]])); // in the body's frame
    this.pull = { body, place, point, target: point };
  }

  // Pulls a part at a point towards a target, like a damped spring: a distance of h weighs STIFFNESS times the body.
  drag(pull) {
    const { data, body: { height, timestep, task: { weight } } } = this;
    const before = pull.point, turn = data.xmat.subarray(9 * pull.body, 9 * pull.body + 9);
    pull.point = [0, 1, 2].map((i) => data.xpos[3 * pull.body + i] + dot(turn.subarray(3 * i, 3 * i + 3), pull.place));
    const stretch = pull.point.map((value, i) => pull.target[i] - value);
    const speed = pull.point.map((value, i) => (value - before[i]) / timestep);
    const damping = Math.sqrt(STIFFNESS / (height * GRAVITY)); // half of the critical one
    const most = STRONGEST / Math.max(Math.hypot(...stretch) / height, STRONGEST / STIFFNESS);
    const force = stretch.map((value, i) => weight * ((most * value) / height - damping * speed[i]));
    const arm = pull.point.map((value, i) => value - data.xipos[3 * pull.body + i]);
    data.xfrc_applied.set([...force, ...cross(arm, force)], 6 * pull.body);
  }

  // Lets go of what is held, which lands.
  release() {
    if (this.pull) this.landing = Infinity;
    this.pull = null;
    this.data.xfrc_applied.fill(0);
  }

  // Adds a velocity [x, y], m/s, to that of a torso by number.
  kick([x, y], number = 0) {
    const { qvel } = this.shares[number]();
    qvel[0] += x;
    qvel[1] += y;
  }

  // MuJoCo's memory is not collected.
  free() {
    this.data.delete();
    this.model.delete();
  }
}
