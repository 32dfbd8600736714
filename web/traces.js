// What steps leave behind: footprints, and dust that settles.
import * as THREE from "three";

const PRINTS = 300, GRAINS = 120, BURST = 8; // at most; grains of a step
const LIFE = 0.8, DRAG = 4; // s, 1/s
const COLOR = [0.62, 0.58, 0.52]; // of dust
const GOLDEN = 2.39996; // rad from grain to grain

// A disk that fades towards its rim.
function disk() {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 64;
  const pen = canvas.getContext("2d"), shade = pen.createRadialGradient(32, 32, 0, 32, 32, 32);
  for (const [place, alpha] of [[0, 1], [0.5, 0.8], [1, 0]]) shade.addColorStop(place, `rgba(255, 255, 255, ${alpha})`);
  pen.fillStyle = shade;
  pen.fillRect(0, 0, 64, 64);
  return new THREE.CanvasTexture(canvas);
}

export class Traces {
  // Takes the standing height of a body, m, and the height of the ground at [x, y].
  constructor(height, ground) {
    Object.assign(this, { height, ground, printed: 0, thrown: 0 });
    const soft = { map: disk(), transparent: true, depthWrite: false };
    const lifted = { polygonOffset: true, polygonOffsetFactor: -2, polygonOffsetUnits: -2 };
    const dark = new THREE.MeshBasicMaterial({ ...soft, ...lifted, color: "#14181d", opacity: 0.36 });
    this.prints = new THREE.InstancedMesh(new THREE.PlaneGeometry(2, 2), dark, PRINTS);
    const grains = new THREE.BufferGeometry();
    for (const [name, size] of [["position", 3], ["color", 4]])
      grains.setAttribute(name, new THREE.BufferAttribute(new Float32Array(size * GRAINS), size));
    this.dust = new THREE.Points(grains, new THREE.PointsMaterial({ ...soft, vertexColors: true, size: 0.3 * height }));
    this.grains = Array.from({ length: GRAINS }, () => ({ age: LIFE, place: [0, 0, 0], speed: [0, 0, 0], alpha: 0 }));
    this.group = new THREE.Group().add(this.prints, this.dust);
    for (const each of this.group.children) each.frustumCulled = false;
    this.clear();
  }

  clear() {
    this.printed = 0;
    this.prints.count = 0;
    for (const grain of this.grains) grain.age = LIFE;
  }

  // Leaves a print of a radius at [x, y], m, and throws dust as strongly as the foot came down, from 0 to 1.
  add([x, y], radius, strength) {
    const { height, ground } = this, step = 0.1 * height, z = ground(x, y);
    const slope = [ground(x + step, y) - ground(x - step, y), ground(x, y + step) - ground(x, y - step)];
    const normal = new THREE.Vector3(-slope[0], -slope[1], 2 * step).normalize();
    const turn = new THREE.Quaternion().setFromUnitVectors(new THREE.Vector3(0, 0, 1), normal);
    const place = new THREE.Vector3(x, y, z).addScaledVector(normal, 2e-3 * height);
    const print = new THREE.Matrix4().compose(place, turn, new THREE.Vector3().setScalar(1.2 * radius));
    this.prints.setMatrixAt(this.printed % PRINTS, print);
    this.prints.instanceMatrix.needsUpdate = true;
    this.printed += 1;
    this.prints.count = Math.min(this.printed, PRINTS);
    const speed = strength * Math.sqrt(height);
    for (let count = 0; count < BURST; count += 1, this.thrown += 1) {
      const angle = GOLDEN * this.thrown, way = [Math.cos(angle), Math.sin(angle)];
      Object.assign(this.grains[this.thrown % GRAINS], {
        age: 0,
        alpha: 0.5 * strength,
        place: [x + radius * way[0], y + radius * way[1], z + 0.05 * height],
        speed: [speed * way[0], speed * way[1], 0.4 * speed],
      });
    }
  }

  // Moves the dust, and draws what is still in the air.
  advance(seconds) {
    const { position, color } = this.dust.geometry.attributes, slower = Math.exp(-DRAG * seconds);
    for (const grain of this.grains) grain.age += seconds;
    const flying = this.grains.filter(({ age }) => age < LIFE);
    flying.forEach((grain, index) => {
      grain.place = grain.place.map((value, i) => value + seconds * grain.speed[i]);
      grain.speed = grain.speed.map((value) => value * slower);
      position.setXYZ(index, ...grain.place);
      color.setXYZW(index, ...COLOR, grain.alpha * (1 - grain.age / LIFE));
    });
    this.dust.geometry.setDrawRange(0, flying.length);
    position.needsUpdate = color.needsUpdate = true;
  }
}
