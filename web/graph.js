// Trained policies: nodes on float32 numbers of one environment, a leading axis of 1; see arc_suite.policies.graph.

const EPSILON = 1e-5; // of a layer norm

const count = (shape) => shape.reduce((product, length) => product * length, 1);
const array = (shape, values) => ({ shape, data: Float32Array.from(values) });
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

// Steps along each axis of an array; 0 along axes of length 1, which are repeated.
function strides(shape) {
  return shape.map((length, axis) => (length === 1 ? 0 : count(shape.slice(axis + 1))));
}

// Computes number by number, with axes repeated as NumPy does.
function elementwise(compute) {
  return (...inputs) => {
    const rank = Math.max(...inputs.map(({ shape }) => shape.length));
    const shapes = inputs.map(({ shape }) => [...Array(rank - shape.length).fill(1), ...shape]);
    const shape = Array.from({ length: rank }, (_, axis) => {
      const lengths = shapes.map((each) => each[axis]);
      return lengths.find((length) => length !== 1) ?? 1;
    });
    const steps = shapes.map(strides);
    const data = Float32Array.from({ length: count(shape) }, (_, index) => {
      const places = inputs.map(() => 0);
      for (let axis = rank - 1, rest = index; axis >= 0; axis -= 1) {
        const place = rest % shape[axis];
        steps.forEach((each, input) => (places[input] += place * each[axis]));
        rest = (rest - place) / shape[axis];
      }
      return compute(...inputs.map(({ data: values }, input) => values[places[input]]));
    });
    return { shape, data };
  };
}

const mean = (values) => values.reduce((sum, value) => sum + value, 0) / values.length;
const add = elementwise((a, b) => a + b);

// Products of rows with a matrix.
function product({ shape: [rows], data }, { shape: [inner, outer], data: weight }) {
  const found = new Float32Array(rows * outer);
  for (let row = 0; row < rows; row += 1) {
    for (let o = 0; o < outer; o += 1) {
      let sum = 0;
      for (let i = 0; i < inner; i += 1) sum += data[row * inner + i] * weight[i * outer + o];
      found[row * outer + o] = sum;
    }
  }
  return { shape: [rows, outer], data: found };
}

function layerNorm({ shape, data }, scale, offset) {
  const width = shape.at(-1), found = new Float32Array(data.length);
  for (let start = 0; start < data.length; start += width) {
    const row = data.subarray(start, start + width), middle = mean(row), centered = row.map((value) => value - middle);
    const deviation = Math.sqrt(mean(centered.map((value) => value * value)) + EPSILON);
    found.set(centered.map((value, i) => (value / deviation) * scale.data[i] + offset.data[i]), start);
  }
  return { shape, data: found };
}

// The rows where a mask is not 0.
function pick({ shape, data }, mask) {
  const width = shape.at(-1), kept = data.filter((_, index) => mask.data[Math.floor(index / width)] > 0);
  return { shape: [kept.length / width, width], data: kept };
}

// Rows where a mask is not 0, and 0 elsewhere.
function place({ shape: [, width], data }, mask) {
  const found = new Float32Array(mask.data.length * width);
  let row = 0;
  mask.data.forEach((there, index) => {
    if (there > 0) found.set(data.subarray(row * width, (row += 1) * width), index * width);
  });
  return { shape: [...mask.shape, width], data: found };
}

// Sums over the axis after that of environments.
function sum({ shape: [, length, ...rest], data }) {
  const found = new Float32Array(count(rest));
  for (let i = 0; i < length; i += 1) found.forEach((_, at) => (found[at] += data[i * found.length + at]));
  return { shape: [1, ...rest], data: found };
}

function concat(...inputs) {
  const values = inputs.flatMap(({ data }) => Array.from(data));
  return array([1, values.length], values);
}

const OPERATORS = {
  Add: add,
  Clip: elementwise(clamp),
  Concat: concat,
  Div: elementwise((a, b) => a / b),
  Elu: elementwise((value) => (value > 0 ? value : Math.expm1(value))),
  Equal: elementwise((a, b) => a === b),
  Greater: elementwise((a, b) => a > b),
  GreaterOrEqual: elementwise((a, b) => a >= b),
  LayerNorm: layerNorm,
  Linear: (x, weight, bias) => add(product(x, weight), bias),
  Max: elementwise(Math.max),
  Mul: elementwise((a, b) => a * b),
  Neg: elementwise((value) => -value),
  Pick: pick,
  Place: place,
  Product: product,
  Relu: elementwise((value) => Math.max(value, 0)),
  Sqrt: elementwise(Math.sqrt),
  Sub: elementwise((a, b) => a - b),
  Sum: sum,
  Take: ({ data }, { shape, data: places }) => array([1, ...shape], Array.from(places, (at) => data[at])),
  Tanh: elementwise(Math.tanh),
};

const bytes = (base64) => Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0)).buffer;
const TYPES = { float32: Float32Array, int32: Int32Array };

export class Graph {
  constructor({ blocks, nodes, arrays }) {
    this.blocks = blocks;
    this.nodes = nodes;
    this.arrays = Object.fromEntries(
      Object.entries(arrays).map(([name, { type, shape, data }]) => [name, { shape, data: new TYPES[type](bytes(data)) }]),
    );
  }

  // Returns actions of the motors for blocks of an observation.
  act(observation) {
    const known = { ...this.arrays, observations: concat(...this.blocks.map((name) => ({ data: observation[name] }))) };
    const results = [];
    for (const [operator, ...inputs] of this.nodes) {
      const given = inputs.map((input) => (typeof input === "number" ? results[input] : known[input]));
      results.push(OPERATORS[operator](...given));
    }
    return Array.from(results.at(-1).data, (action) => clamp(action, -1, 1));
  }
}
