// Sounds of steps, made as they are heard: a thump and a rustle, deeper for larger bodies.
const LENGTH = 0.16; // s
const LOUD = 0.5;

// Noise that is the same each time.
function noise(context) {
  const buffer = context.createBuffer(1, Math.ceil(LENGTH * context.sampleRate), context.sampleRate);
  let seed = 1;
  buffer.getChannelData(0).forEach((_, index, values) => {
    seed = (Math.imul(seed, 1664525) + 1013904223) >>> 0;
    values[index] = seed / 2 ** 31 - 1;
  });
  return buffer;
}

export class Sound {
  constructor() {
    this.on = true;
    this.heard = 0; // steps
    // Browsers let a page sound once somebody has used it.
    for (const event of ["pointerup", "keydown"]) window.addEventListener(event, () => this.open(), { once: true });
  }

  open() {
    if (this.context || !window.AudioContext) return;
    this.context = new AudioContext();
    this.noise = noise(this.context);
  }

  // A step of a strength from 0 to 1 under a body of a height, m.
  step(strength, height) {
    if (!this.on || this.context?.state !== "running") return;
    const { context, noise: buffer } = this, now = context.currentTime, pitch = 110 / Math.sqrt(height);
    const thump = new OscillatorNode(context, { frequency: pitch });
    thump.frequency.exponentialRampToValueAtTime(0.4 * pitch, now + LENGTH);
    const rustle = new AudioBufferSourceNode(context, { buffer });
    const muffled = new BiquadFilterNode(context, { type: "lowpass", frequency: (4 + 8 * strength) * pitch });
    for (const [source, path, gain] of [[thump, thump, 1], [rustle, rustle.connect(muffled), 0.4]]) {
      const level = new GainNode(context, { gain: LOUD * gain * strength });
      level.gain.exponentialRampToValueAtTime(1e-3, now + LENGTH);
      path.connect(level).connect(context.destination);
      source.start(now);
      source.stop(now + LENGTH);
    }
    this.heard += 1;
  }
}
