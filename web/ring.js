// A ring in which two bodies push each other, and how often each has left it.
import * as THREE from "three";

const RADIUS = 3.5; // reaches
const POINTS = 96; // of the line on the ground
const COLOR = "#ffd23f";

export class Ring {
  // Takes its center [x, y], how far the bodies reach and their standing height, m, and the height of the ground.
  constructor([x, y], reach, height, ground) {
    Object.assign(this, { center: [x, y], radius: RADIUS * reach, score: [0, 0] });
    const points = Array.from({ length: POINTS }, (_, i) => {
      const angle = (2 * Math.PI * i) / POINTS;
      const [px, py] = [x + this.radius * Math.cos(angle), y + this.radius * Math.sin(angle)];
      return new THREE.Vector3(px, py, ground(px, py) + 0.03 * height);
    });
    const tube = new THREE.TubeGeometry(new THREE.CatmullRomCurve3(points, true), 2 * POINTS, 0.04 * height, 6, true);
    this.group = new THREE.Group().add(new THREE.Mesh(tube, new THREE.MeshBasicMaterial({ color: COLOR })));
  }

  // Takes the places [x, y] of the player's body and of the other; returns whether one has left the ring.
  advance(places) {
    const [mine, theirs] = places.map(([x, y]) => Math.hypot(x - this.center[0], y - this.center[1]) > this.radius);
    if (mine) this.score[1] += 1;
    else if (theirs) this.score[0] += 1;
    return mine || theirs;
  }

  toString() {
    return `you ${this.score[0]}, rival ${this.score[1]}`;
  }
}
