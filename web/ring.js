// A ring in which two bodies push each other in rounds, and how many each has won.
import * as THREE from "three";

const RADIUS = 3; // reaches
const LIMIT = 30; // s of a round
const NEWS = 2.5; // s for which a round says who won the last one
const TURN = 1.8; // rad, by which bodies are turned off each other at most as a round begins
const POINTS = 96; // of the line on the ground
const COLOR = "#ffd23f";

export class Ring {
  // Takes its center [x, y], how far the bodies reach and their standing height, m, and the height of the ground.
  constructor([x, y], reach, height, ground) {
    Object.assign(this, { center: [x, y], radius: RADIUS * reach });
    this.begin();
    const points = Array.from({ length: POINTS }, (_, i) => {
      const angle = (2 * Math.PI * i) / POINTS;
      const [px, py] = [x + this.radius * Math.cos(angle), y + this.radius * Math.sin(angle)];
      return new THREE.Vector3(px, py, ground(px, py) + 0.03 * height);
    });
    const tube = new THREE.TubeGeometry(new THREE.CatmullRomCurve3(points, true), 2 * POINTS, 0.04 * height, 6, true);
    this.group = new THREE.Group().add(new THREE.Mesh(tube, new THREE.MeshBasicMaterial({ color: COLOR })));
  }

  // Begins the first round.
  begin() {
    Object.assign(this, { score: [0, 0], time: 0, winner: null });
  }

  // Turns of the bodies as the round begins, rad: face to face in the first one, and other in each that follows.
  get turns() {
    const round = this.score[0] + this.score[1], turn = TURN * Math.sin(2.4 * round);
    return [turn, Math.PI + turn];
  }

  // Ends the round by a point for a body by number.
  win(number) {
    this.score[number] += 1;
    Object.assign(this, { time: 0, winner: number });
  }

  // Takes seconds, and the places [x, y] of the player's body and of the other; returns whether the round is over: who
  // leaves the ring loses it and, where nobody has at the end of its time, who is farther from the center.
  advance(seconds, places) {
    const [mine, theirs] = places.map(([x, y]) => Math.hypot(x - this.center[0], y - this.center[1]));
    this.time += seconds;
    if (Math.max(mine, theirs) <= this.radius && this.time < LIMIT) return false;
    this.win(mine > theirs ? 1 : 0);
    return true;
  }

  toString() {
    const news = this.winner !== null && this.time < NEWS ? ["you win the round: ", "the rival wins the round: "][this.winner] : "";
    return `${news}you ${this.score[0]}, rival ${this.score[1]}, ${Math.ceil(LIMIT - this.time)} s`;
  }
}
