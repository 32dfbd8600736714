// Getting up after a fall, as arc_suite.tasks.recover defines it: by a policy, or by holding the standing pose.
import { Graph } from "./graph.js";
import { clamp } from "./legs.js";

// Holds the standing pose, as arc_suite.cpg.rising does; servos do so by themselves.
class Rising {
  constructor(constants) {
    this.constants = constants;
  }

  act({ posture, velocities }) {
    const { stiffness, damping, servos } = this.constants;
    if (servos) return stiffness.map(() => 0);
    return stiffness.map((value, i) => clamp(-value * posture[5 + i] - damping[i] * velocities[6 + i], -1, 1));
  }
}

const POLICIES = { rising: Rising, graph: Graph };

export class Recovery {
  constructor({ policy, ...constants }) {
    this.constants = constants;
    this.driver = new POLICIES[policy.kind](policy.constants);
    this.on = false; // whether the body is getting up
    this.count = 0; // control steps in which it has lain, or has been up, without a break
  }

  // Takes the readings after a control step: whether the body lies, its height, m, and the cosine of its tilt.
  after(lies, height, upright) {
    const { lowest, least_upright: least, steps, patience } = this.constants;
    const holds = this.on ? height > lowest && upright > least : lies;
    this.count = holds ? this.count + 1 : 0;
    if (this.count < (this.on ? steps : patience)) return;
    this.on = !this.on;
    this.count = 0;
  }
}
