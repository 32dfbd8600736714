// A kick that grows while its key, its button or a gamepad's is held.
const LEAST = 0.8, MOST = 2.4; // sqrt(g h), the velocity that a kick adds
const GROWTH = 1500; // ms to the strongest

export class Kick {
  constructor() {
    this.start = null; // ms
  }

  begin() {
    this.start ??= performance.now();
  }

  // How much of its strength a kick has that is held, from 0 to 1.
  get share() {
    return this.start === null ? 0 : Math.min((performance.now() - this.start) / GROWTH, 1);
  }

  // Returns the strength of the kick that was held, or 0 without one.
  end() {
    const strength = this.start === null ? 0 : LEAST + this.share * (MOST - LEAST);
    this.start = null;
    return strength;
  }
}
