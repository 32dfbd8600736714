// Trained policies: graphs of ONNX operators on float32 numbers for one environment; see arc_suite.policies.graphs.

const count = (shape) => shape.reduce((product, length) => product * length, 1);
const tensor = (shape, values) => ({ shape, data: Float32Array.from(values) });
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

// Steps along each axis of an array; 0 along axes of length 1, which are repeated.
function strides(shape) {
  return shape.map((length, axis) => (length === 1 ? 0 : count(shape.slice(axis + 1))));
}

// Computes number by number, with axes repeated as NumPy does.
function elementwise(compute) {
  return (inputs) => {
    const rank = Math.max(...inputs.map(({ shape }) => shape.length));
    const shapes = inputs.map(({ shape }) => [...Array(rank - shape.length).fill(1), ...shape]);
    const shape = Array.from({ length: rank }, (_, axis) => Math.max(...shapes.map((each) => each[axis])));
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

// Reduces the second axis, which stays with the length 1.
function reduction(compute) {
  return ([{ shape: [, length, ...rest], data }]) => {
    const width = count(rest);
    const column = (start) => Array.from({ length }, (_, row) => data[row * width + start]);
    return tensor([1, 1, ...rest], Array.from({ length: width }, (_, start) => compute(column(start))));
  };
}

const mean = (values) => values.reduce((sum, value) => sum + value, 0) / values.length;

// Products of the rows of an array with a matrix.
function matMul([{ shape, data }, { shape: [inner, outer], data: weight }]) {
  const rows = data.length / inner, found = new Float32Array(rows * outer);
  for (let row = 0; row < rows; row += 1) {
    for (let o = 0; o < outer; o += 1) {
      let sum = 0;
      for (let i = 0; i < inner; i += 1) sum += data[row * inner + i] * weight[i * outer + o];
      found[row * outer + o] = sum;
    }
  }
  return { shape: [...shape.slice(0, -1), outer], data: found };
}

const add = elementwise((a, b) => a + b);

function layerNormalization([{ shape, data }, scale, offset], { epsilon }) {
  const middle = mean(data), centred = data.map((value) => value - middle);
  const deviation = Math.sqrt(mean(centred.map((value) => value * value)) + epsilon);
  return { shape, data: centred.map((value, i) => (value / deviation) * scale.data[i] + offset.data[i]) };
}

// Arrays of the same rows, one after the other along the last axis.
function concat(inputs) {
  const widths = inputs.map(({ shape }) => shape.at(-1)), leading = inputs[0].shape.slice(0, -1);
  const rows = Array.from({ length: count(leading) }, (_, row) =>
    inputs.flatMap(({ data }, input) => [...data.subarray(row * widths[input], (row + 1) * widths[input])]),
  );
  return tensor([...leading, widths.reduce((sum, width) => sum + width, 0)], rows.flat());
}

const OPERATORS = {
  Abs: elementwise(Math.abs),
  Add: add,
  Cast: ([x]) => x, // truth values are 0 and 1 already
  Clip: elementwise(clamp),
  Concat: concat,
  Div: elementwise((a, b) => a / b),
  Elu: elementwise((value) => (value > 0 ? value : Math.expm1(value))),
  Gather: ([{ data }, indices]) => tensor([1, indices.data.length], Array.from(indices.data, (index) => data[index])),
  Gemm: ([x, weight, bias]) => add([matMul([x, weight]), bias]),
  Greater: elementwise((a, b) => a > b),
  GreaterOrEqual: elementwise((a, b) => a >= b),
  LayerNormalization: layerNormalization,
  MatMul: matMul,
  Max: elementwise(Math.max),
  Mul: elementwise((a, b) => a * b),
  Not: elementwise((value) => !value),
  Or: elementwise((a, b) => a || b),
  ReduceMax: reduction((values) => Math.max(...values)),
  ReduceMean: reduction(mean),
  Relu: elementwise((value) => Math.max(value, 0)),
  Reshape: ([{ data }, shape]) => ({ shape: [1, ...shape.data.slice(1)], data }),
  Sqrt: elementwise(Math.sqrt),
  Sub: elementwise((a, b) => a - b),
  Tanh: elementwise(Math.tanh),
};

const bytes = (base64) => Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0)).buffer;
const CONSTANTS = { float: (text) => new Float32Array(bytes(text)), integer: (text) => new Int32Array(bytes(text)) };

export class Graph {
  constructor({ blocks, nodes, constants }) {
    this.blocks = blocks;
    this.nodes = nodes;
    this.constants = Object.fromEntries(
      Object.entries(constants).map(([name, { kind, shape, data }]) => [name, { shape, data: CONSTANTS[kind](data) }]),
    );
  }

  // Returns actions of the motors for blocks of an observation.
  act(observation) {
    const inputs = this.blocks.flatMap((name) => Array.from(observation[name]));
    const found = { ...this.constants, observations: tensor([1, inputs.length], inputs) };
    for (const { operator, inputs: names, result, attributes } of this.nodes) {
      found[result] = OPERATORS[operator](names.map((name) => found[name]), attributes);
    }
    return Array.from(found.actions.data, (action) => clamp(action, -1, 1));
  }
}
