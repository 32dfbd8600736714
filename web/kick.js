// A kick that grows while its key, its button or a gamepad's is held.
const LEAST = 0.35; // of the largest kick
const GROWTH = 1500; // ms to the largest

export class Kick {
  constructor() {
    this.start = null; // ms
  }

  begin() {
    this.start ??= performance.now();
  }

  // How far a kick that is held has grown, from 0 to 1.
  get share() {
    return this.start === null ? 0 : Math.min((performance.now() - this.start) / GROWTH, 1);
  }

  // Returns the kick that was held, as a share of the largest one; 0 without one.
  end() {
    const size = this.start === null ? 0 : LEAST + this.share * (1 - LEAST);
    this.start = null;
    return size;
  }
}
