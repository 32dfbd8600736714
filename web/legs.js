// Kinematics of legs under a torso in a pose, as arc_suite.models.kinematics and posture define them.

export const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
export const wrapped = (angle) => Math.atan2(Math.sin(angle), Math.cos(angle));
const dot = (first, second) => first.reduce((sum, value, index) => sum + value * second[index], 0);
const plus = (first, second) => first.map((value, index) => value + second[index]);
const minus = (first, second) => first.map((value, index) => value - second[index]);
const cross = ([a, b, c], [x, y, z]) => [b * z - c * y, c * x - a * z, a * y - b * x];
const columnsOf = (matrix) => matrix[0].map((_, column) => matrix.map((row) => row[column]));
const times = (matrix, vector) => matrix.map((row) => dot(row, vector));
const product = (first, second) => {
  const columns = columnsOf(second);
  return first.map((row) => columns.map((column) => dot(row, column)));
};

// The rotation by an angle about a unit axis, after Rodrigues; none about an axis of 0.
function rotation([x, y, z], angle) {
  const skew = [[0, -z, y], [z, 0, -x], [-y, x, 0]], square = product(skew, skew);
  const sine = Math.sin(angle), rest = 1 - Math.cos(angle);
  return skew.map((row, i) => row.map((value, j) => (i === j ? 1 : 0) + sine * value + rest * square[i][j]));
}

// The place of a leg's sole at angles of its links, m, and for each link how the sole moves as it turns.
function sole({ mount, turn, axes, ends, radius }, angles) {
  let frame = turn, place = mount;
  const joints = angles.map((angle, link) => {
    const joint = { axis: times(frame, axes[link]), anchor: place };
    frame = product(frame, rotation(axes[link], angle));
    place = plus(place, times(frame, ends[link]));
    return joint;
  });
  place = minus(place, [0, 0, radius]);
  return { place, moves: joints.map(({ axis, anchor }) => cross(axis, minus(place, anchor))) };
}

// Solves three equations with a symmetric matrix, by Cramer's rule.
function solve([a, b, c], right) {
  const inverse = [cross(b, c), cross(c, a), cross(a, b)], determinant = dot(a, inverse[0]);
  return [0, 1, 2].map((i) => dot(right, inverse.map((row) => row[i])) / determinant);
}

// The least changes of angles, with damping, that make up for what a sole misses.
function least(moves, missing, damping) {
  const square = [0, 1, 2].map((i) =>
    [0, 1, 2].map((j) => moves.reduce((sum, move) => sum + move[i] * move[j], i === j ? damping ** 2 : 0)),
  );
  const force = solve(square, missing);
  return moves.map((move) => dot(move, force));
}

// Angles of a leg's links, from given ones, that bring its sole near a goal, by damped least squares.
export function reached(leg, angles, goal, weights, damping, steps) {
  for (let count = 0; count < steps; count += 1) {
    const { place, moves } = sole(leg, angles);
    const missing = times(weights, minus(goal, place)), weighed = moves.map((move) => times(weights, move));
    const change = least(weighed, missing, damping);
    const bound = (angle, link) =>
      (angle <= leg.low[link] && change[link] < 0) || (angle >= leg.high[link] && change[link] > 0);
    // Joints at their bounds must not hold the others up.
    const free = weighed.map((move, link) => (bound(angles[link], link) ? [0, 0, 0] : move));
    const turned = plus(angles, least(free, missing, damping));
    angles = turned.map((angle, link) => clamp(angle, leg.low[link], leg.high[link]));
  }
  return angles;
}

// Angles of a leg's links nearer to those at rest, where its sole stays, if it has more than three joints.
export function relaxed(leg, angles, share, damping) {
  if (leg.moves.filter(Boolean).length <= 3) return angles;
  const way = leg.angles.map((angle, link) => share * (angle - angles[link])), { moves } = sole(leg, angles);
  const displacement = [0, 1, 2].map((i) => moves.reduce((sum, move, link) => sum + move[i] * way[link], 0));
  const turned = plus(angles, minus(way, least(moves, displacement, damping)));
  return turned.map((angle, link) => clamp(angle, leg.low[link], leg.high[link]));
}

// Weights of an error along a path [x, y], across it, and in height.
export function weighing(path, across) {
  const length = Math.hypot(...path);
  const [x, y] = length > 1e-9 ? path.map((part) => part / length) : [1, 0];
  return [[x, y, 0], [-across * y, across * x, 0], [0, 0, 1]];
}

// A place of the ground, m, as a torso in a pose has it in its frame, given as the torso at rest has it.
export function moved(place, [rise, forward, left, ...angles], height) {
  const shifted = minus(place, [forward, left, rise].map((part) => height * part));
  return times(columnsOf(attitude(angles)), shifted);
}

// The vertical in the frame of a torso, as a torso has it that is turned back by roll, pitch and yaw, rad.
export const verticalAbout = (up, angles) => times(attitude(angles), up);

// The rotation of a torso by roll, pitch and yaw, rad, in this order, about fixed axes.
function attitude(angles) {
  const [[roll, down], [pitch, dip], [yaw, aside]] = angles.map((angle) => [Math.cos(angle), Math.sin(angle)]);
  return [
    [yaw * pitch, yaw * dip * down - aside * roll, yaw * dip * roll + aside * down],
    [aside * pitch, aside * dip * down + yaw * roll, aside * dip * roll - yaw * down],
    [-dip, pitch * down, pitch * roll],
  ];
}

// The vertical in the frame of a torso with an orientation.
export const vertical = ([w, x, y, z]) => [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)];

// Roll and pitch, rad, of a torso in whose frame the vertical is given.
export const tilt = (up) => [Math.atan2(up[1], up[2]), -Math.asin(clamp(up[0], -1, 1))];
