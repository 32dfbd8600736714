// A bone of ornaments that swings, as Python's `swinging` has it: the mass of the bone rings as a damped spring about
// where the part above holds it, and steps of any length are exact.
import * as THREE from "three";

const REARWARD = 0.01; // of a unit vector: a bone that points into the ground falls to the rear

export class Swing {
  // Takes a part of Python's `parts` that swings.
  constructor({ place, swing: { tip, mass, frequency, damping, limit, tip_radius: radius } }) {
    Object.assign(this, { limit, radius, decay: damping * frequency });
    this.rate = frequency * Math.sqrt(1 - damping ** 2); // rad/s, at which it swings freely
    this.pivot = new THREE.Vector3(...place);
    this.mass = new THREE.Vector3(...mass);
    this.direction = new THREE.Vector3(...tip);
    this.length = this.direction.length();
    this.direction.normalize();
    this.anchor = null; // where the torso holds the mass
  }

  // The mass hangs where the part above holds it.
  begin(anchor) {
    this.velocity = new THREE.Vector3();
    this.ring = [new THREE.Vector3(), new THREE.Vector3()]; // real and imaginary part
    this.anchor = anchor;
  }

  advance(anchor, seconds) {
    const [real, imaginary] = this.ring;
    const velocity = anchor.clone().sub(this.anchor).divideScalar(seconds);
    real.sub(velocity).add(this.velocity);
    const fade = Math.exp(-this.decay * seconds);
    const cosine = fade * Math.cos(this.rate * seconds), sine = fade * Math.sin(this.rate * seconds);
    const turned = real.clone().multiplyScalar(cosine).addScaledVector(imaginary, -sine);
    this.ring = [turned, imaginary.multiplyScalar(cosine).addScaledVector(real, sine)];
    Object.assign(this, { anchor, velocity });
  }

  // The turn in the frame of the part above, whose matrix in the world is given, some seconds after the last one; a time
  // below 0 begins anew, and so does a jump at the same time. The ground is at a height, m.
  follow(matrix, seconds, ground = 0) {
    const anchor = this.pivot.clone().add(this.mass).applyMatrix4(matrix);
    if (!this.anchor || seconds < 0 || (seconds === 0 && !anchor.equals(this.anchor))) this.begin(anchor);
    else if (seconds > 0) this.advance(anchor, seconds);
    const frame = new THREE.Quaternion().setFromRotationMatrix(matrix), back = frame.clone().invert();
    const offset = this.ring[1].clone().divideScalar(this.rate).applyQuaternion(back);
    const turn = this.mass.clone().cross(offset).divideScalar(this.mass.lengthSq()), angle = turn.length();
    const bounded = this.limit * Math.tanh(angle / this.limit);
    const direction = this.direction.clone().multiplyScalar(Math.cos(bounded));
    direction.addScaledVector(turn.divideScalar(Math.max(angle, 1e-12)).cross(this.direction), Math.sin(bounded));

    const height = this.pivot.clone().applyMatrix4(matrix).z - ground;
    const rise = Math.min(Math.max((this.radius - height) / this.length, -1), 1);
    direction.applyQuaternion(frame);
    if (direction.z < rise) {
      direction.addScaledVector(new THREE.Vector3(-REARWARD, 0, 0).applyQuaternion(frame), 1).setZ(0);
      direction.setLength(Math.sqrt(1 - rise ** 2)).setZ(rise);
    }
    return new THREE.Quaternion().setFromUnitVectors(this.direction, direction.applyQuaternion(back));
  }
}
