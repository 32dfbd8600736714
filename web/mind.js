// A body's task and policy, on its share of the data of a model with several like bodies.
import { Graph } from "./graph.js";
import { Law } from "./law.js";
import { Recovery } from "./recovery.js";
import { Task } from "./task.js";

const POLICIES = { law: Law, graph: Graph };

export class Mind {
  // Takes a body of a page's data, the height of the ground at [x, y], and a function that returns its share of data.
  constructor({ task, policy, recovery }, ground, share) {
    this.share = share;
    this.task = new Task(task, ground);
    this.task.begin(share());
    this.driver = new POLICIES[policy.kind](policy.constants);
    this.recovery = recovery && new Recovery(recovery);
  }

  // Whether the body lies, or is getting up.
  get fell() {
    return this.task.fell || this.rises;
  }

  get rises() {
    return Boolean(this.recovery?.on);
  }

  // Starts a control step with a new action, and with the commands that a function returns.
  act(asked) {
    const data = this.share(), driver = this.rises ? this.recovery.driver : this.driver;
    const action = driver.act(this.task.observe(data));
    this.task.command(asked());
    data.ctrl.set(action);
  }

  // Ends a control step. A body that lies, as a function tells, begins to get up; one that is up walks on.
  after(lies) {
    const data = this.share(), rose = this.rises;
    this.task.after(data);
    this.recovery?.after(lies(), this.task.height(data.qpos), this.task.upright(data.qpos));
    if (rose && !this.rises) this.driver.begin?.();
  }
}

// The share of one of several like bodies by number: without the world, which is the first of MuJoCo's bodies.
export function shareOf(data, number, count) {
  const own = (values) => values.subarray((number * values.length) / count, ((number + 1) * values.length) / count);
  const from = (values, size) => values.subarray((number * (values.length - size)) / count);
  const { qpos, qvel, ctrl, xpos, xquat, cfrc_ext } = data;
  const parts = { xpos: from(xpos, 3), xquat: from(xquat, 4), cfrc_ext: from(cfrc_ext, 6) };
  return { qpos: own(qpos), qvel: own(qvel), ctrl: own(ctrl), ...parts };
}

// The MJCF of two bodies that meet, given that of one: it touches what touches it, as the ground does.
export function doubled(xml) {
  const part = (from, to) => xml.slice(xml.indexOf(from), xml.lastIndexOf(to) + to.length);
  const named = (text) => text.replace(/ (name|joint|joint[12]|site[12])="/g, ' $1="rival_');
  const touched = (text) => text.replace(/contype="1"([^>]*?)conaffinity="0"/g, 'contype="0"$1conaffinity="1"');
  const sections = ["equality", "actuator"].filter((tag) => xml.includes(`<${tag}>`));
  const further = sections.map((tag) => named(part(`<${tag}>`, `</${tag}>`))).join("");
  return xml
    .replace(/<keyframe>.*<\/keyframe>/s, "") // of one body
    .replace("</worldbody>", `${named(touched(part("<body ", "</body>")))}</worldbody>`)
    .replace("</mujoco>", `${further}</mujoco>`);
}
