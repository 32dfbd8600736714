// The laws `steered` and `surefooted`, as arc_suite.cpg.steering defines them, with constants that Python computed.

const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
const share = (value) => value - Math.floor(value); // of a cycle
const dot = (first, second) => first.reduce((sum, value, index) => sum + value * second[index], 0);

// Solves a small dense system by Gaussian elimination with partial pivoting; overwrites both arguments.
function solve(matrix, right) {
  const count = right.length;
  for (let column = 0; column < count; column += 1) {
    let pivot = column;
    for (let row = column + 1; row < count; row += 1)
      if (Math.abs(matrix[row][column]) > Math.abs(matrix[pivot][column])) pivot = row;
    [matrix[column], matrix[pivot]] = [matrix[pivot], matrix[column]];
    [right[column], right[pivot]] = [right[pivot], right[column]];
    for (let row = column + 1; row < count; row += 1) {
      const factor = matrix[row][column] / matrix[column][column];
      for (let k = column; k < count; k += 1) matrix[row][k] -= factor * matrix[column][k];
      right[row] -= factor * right[column];
    }
  }
  for (let row = count - 1; row >= 0; row -= 1) {
    for (let k = row + 1; k < count; k += 1) right[row] -= matrix[row][k] * right[k];
    right[row] /= matrix[row][row];
  }
  return right;
}

// Joint angles that move a foot along a path [x, y], m, and the share of the path that they manage.
function sweep({ jacobian, room, damping }, path, across, level) {
  const length = Math.hypot(path[0], path[1]);
  const [x, y] = length > 1e-9 ? [path[0] / length, path[1] / length] : [1, 0];
  const columns = room.map((_, joint) => jacobian.map((row) => row[joint])); // of the Jacobian
  const weighted = columns.map(([dx, dy, dz]) => [x * dx + y * dy, across * (x * dy - y * dx), level * dz]);
  const square = weighted.map((first, i) => weighted.map((second, j) => dot(first, second) + (i === j ? damping[i] : 0)));
  let angles = solve(square, weighted.map((column) => column[0] * length));
  const moved = [0, 1, 2].map((row) => angles.reduce((sum, angle, joint) => sum + weighted[joint][row] * angle, 0));
  const longer = (moved[0] * length) / Math.max(dot(moved, moved), 1e-12);
  angles = angles.map((angle) => angle * longer);
  const fits = Math.min(1, ...angles.map((angle, joint) => room[joint] / Math.max(Math.abs(angle), 1e-12)));
  angles = angles.map((angle) => angle * fits);
  if (length <= 1e-9) return { angles, able: 1 };
  const reached = angles.reduce((sum, angle, joint) => sum + (x * columns[joint][0] + y * columns[joint][1]) * angle, 0);
  return { angles, able: clamp(reached / length, 0, 1) };
}

export class Law {
  constructor(constants) {
    this.constants = constants;
    const zero = [0, 0, 0];
    this.state = { command: zero, integral: zero, motion: zero, size: 0, phase: 0 };
  }

  // Returns actions of motors or servos for blocks of an observation, and remembers what the next step needs.
  act({ posture, velocities, command, gait_clock: clock }) {
    const c = this.constants, state = this.state;
    const going = clock[0] !== 0 || clock[1] !== 0;
    const asked = command.slice(0, 3), motion = command.slice(3);
    const smooth = state.command.map((value, i) => value + c.smoothing * (asked[i] - value));
    const integral = state.integral.map((value, i) =>
      going ? clamp(value + c.integral * (asked[i] - motion[i]), -1, 1) : 0,
    );
    const size = clamp(state.size + (going ? c.onset : -c.onset), 0, 1);
    const phase = going ? Math.atan2(clock[0], clock[1]) / (2 * Math.PI) : state.phase; // held at rest
    const advance = going ? c.cycles : 0;
    const requested = going
      ? smooth.map((value, i) => value + integral[i] + c.gain[i] * (value - motion[i]))
      : state.motion;
    this.state = { command: smooth, integral, motion: requested, size, phase: phase + advance };
    const { targets, changes } = this.planned(requested, size, phase, advance, posture.slice(1, 5));
    return targets.map((target, joint) => {
      const speed = changes[joint] / c.step, stiffness = c.stiffness[joint], damping = c.damping[joint];
      if (c.reach) return clamp((target + (damping * speed) / stiffness) / c.reach[joint], -1, 1); // a servo's angle
      return clamp(stiffness * (target - posture[5 + joint]) - damping * (velocities[6 + joint] - speed), -1, 1);
    });
  }

  // Target angles of the joints, rad, and their changes in a control step.
  planned(requested, size, phase, advance, [w, x, y, z]) {
    const c = this.constants, targets = [], changes = [];
    const [forward, left, turn] = requested.map((value, i) => value * c.units[i]);
    const vertical = [2 * (x * z - w * y), 2 * (y * z + w * x)]; // of the world, in the torso's frame
    c.legs.forEach((leg, index) => {
      const foot = c.feet[index];
      const path = [c.half_stance * (forward - turn * foot[1]), c.half_stance * (left + turn * foot[0])];
      const { angles, able } = sweep(leg, path, c.across, c.level);
      const low = -(vertical[0] * foot[0] + vertical[1] * foot[1]) / c.height;
      const raised = (1 - able) * c.unload - c.attitude * low; // the low side of the torso is pushed up
      const departures = [phase, phase + advance].map((at) => {
        const cycle = share(at + leg.offset), stands = cycle < c.duty_factor;
        const progress = stands ? cycle / c.duty_factor : (cycle - c.duty_factor) / (1 - c.duty_factor);
        const along = stands ? 1 - 2 * progress : 2 * progress - 1;
        const lift = raised + (stands ? 0 : Math.sin(Math.PI * progress));
        return angles.map((angle, joint) => size * (along * angle + lift * leg.lift[joint]));
      });
      departures[0].forEach((departure, joint) => {
        targets.push(c.neutral[targets.length] + departure);
        changes.push(departures[1][joint] - departure);
      });
    });
    return { targets, changes };
  }
}
