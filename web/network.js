// Trained policies: layers of float32 numbers, as arc_suite.policies.network defines them.

const EPSILON = 1e-5; // of a layer norm

const mean = (values) => values.reduce((sum, value) => sum + value, 0) / values.length;

function linear(x, [weight, bias]) {
  const outputs = Float32Array.from(bias);
  for (let o = 0; o < bias.length; o += 1) {
    let sum = 0;
    for (let i = 0; i < x.length; i += 1) sum += x[i] * weight[i * bias.length + o];
    outputs[o] += sum;
  }
  return outputs;
}

function layerNorm(x, [scale, offset]) {
  const middle = mean(x), centred = x.map((value) => value - middle);
  const deviation = Math.sqrt(mean(centred.map((value) => value * value)) + EPSILON);
  return centred.map((value, i) => (value / deviation) * scale[i] + offset[i]);
}

const clamp = (value, limit) => Math.min(Math.max(value, -limit), limit);

const KINDS = {
  linear,
  layer_norm: layerNorm,
  normalise: (x, [middle, factor, [limit]]) => x.map((value, i) => clamp((value - middle[i]) * factor[i], limit)),
  relu: (x) => x.map((value) => Math.max(value, 0)),
  elu: (x) => x.map((value) => (value > 0 ? value : Math.expm1(value))),
  tanh: (x) => x.map(Math.tanh),
  clip: (x) => x.map((value) => clamp(value, 1)),
};

const floats = (base64) => new Float32Array(Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0)).buffer);

export class Network {
  constructor({ blocks, layers }) {
    this.blocks = blocks;
    this.layers = layers.map(({ kind, arrays }) => ({ kind, arrays: arrays.map(floats) }));
  }

  // Returns actions of the motors for blocks of an observation.
  act(observation) {
    const inputs = Float32Array.from(this.blocks.flatMap((name) => Array.from(observation[name])));
    return Array.from(this.layers.reduce((x, { kind, arrays }) => KINDS[kind](x, arrays), inputs), (a) => clamp(a, 1));
  }
}
