// Goals to reach one after another in rounds, and the time that it takes; browsers keep the best one.
import * as THREE from "three";

const PLACES = [[7, 2], [11, -4], [6, -9], [-1, -6], [0, 0]]; // standing heights from the start, in the first round
const TURN = 1.2; // rad, by which places lie off those of two rounds before; each second round is a mirror image
const COLOR = "#ffd23f";
const REST = 3; // s between two rounds

export class Goals {
  // Takes the standing height of a body and how far it reaches, m, the height of the ground at [x, y], and a name under
  // which a browser keeps the best time.
  constructor(height, reach, ground, name) {
    Object.assign(this, { height, reach, ground, name, best: kept(name) });
    const look = new THREE.MeshBasicMaterial({ color: COLOR, transparent: true, opacity: 0.75 });
    const faint = new THREE.MeshBasicMaterial({ color: COLOR, transparent: true, opacity: 0.14, depthWrite: false });
    const beam = new THREE.CylinderGeometry(reach, reach, 4 * height, 48, 1, true).rotateX(Math.PI / 2);
    this.goal = new THREE.Group().add(
      new THREE.Mesh(new THREE.TorusGeometry(reach, 0.06 * height, 8, 64), look),
      new THREE.Mesh(beam, faint),
    );
    const flat = new THREE.ConeGeometry(0.22 * height, 0.9 * height, 16).rotateZ(-Math.PI / 2).scale(1, 1, 0.15);
    this.arrow = new THREE.Mesh(flat, look);
    this.group = new THREE.Group().add(this.goal, this.arrow);
    this.number = null;
  }

  begin(round = 1) {
    Object.assign(this, { round, number: 0, time: 0, rest: REST });
  }

  get runs() {
    return this.number !== null && this.number < PLACES.length;
  }

  // [x, y] of the next goal, m; ways are equally long in all rounds.
  get place() {
    const [x, y] = PLACES[this.number].map((value) => value * this.height), before = this.round - 1;
    const side = before % 2 ? -1 : 1, angle = side * TURN * Math.floor(before / 2);
    const cosine = Math.cos(angle), sine = Math.sin(angle);
    return [cosine * x - sine * side * y, sine * x + cosine * side * y];
  }

  // Takes seconds of a body on its feet that has come to [x, y].
  advance(seconds, [x, y]) {
    if (this.number === null) return;
    if (!this.runs) {
      this.rest -= seconds;
      if (this.rest <= 0) this.begin(this.round + 1);
      return;
    }
    this.time += seconds;
    if (Math.hypot(this.place[0] - x, this.place[1] - y) > this.reach) return;
    this.number += 1;
    if (this.runs || this.time >= this.best) return;
    this.best = this.time;
    keep(this.name, this.best);
  }

  // Shows the next goal, and the way to it over a body at [x, y, z].
  show([x, y, z]) {
    this.group.visible = this.runs;
    if (!this.runs) return;
    const [goalX, goalY] = this.place;
    this.goal.position.set(goalX, goalY, this.ground(goalX, goalY));
    this.arrow.position.set(x, y, z + 0.8 * this.height);
    this.arrow.rotation.z = Math.atan2(goalY - y, goalX - x);
  }

  toString() {
    if (this.number === null) return "";
    const time = `${this.time.toFixed(1)} s`, best = this.best < Infinity ? `best ${this.best.toFixed(1)} s` : "";
    const now = this.runs ? `goal ${this.number + 1} of ${PLACES.length}, ${time}` : `${PLACES.length} goals in ${time}`;
    return [`round ${this.round}`, now, best].filter(Boolean).join(", ");
  }
}

// The best time that the browser keeps under a name, s; some keep nothing for files.
function kept(name) {
  try {
    return Number(window.localStorage.getItem(name)) || Infinity;
  } catch {
    return Infinity;
  }
}

function keep(name, time) {
  try {
    window.localStorage.setItem(name, time);
  } catch {
    // The time holds until the page is closed.
  }
}
