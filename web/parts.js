// Parts of a body: shapes and materials in MuJoCo's terms, as three.js draws them.
import * as THREE from "three";
import { Swing } from "./swinging.js";

export const quaternion = ([w, x, y, z]) => new THREE.Quaternion(x, y, z, w);

export function geometry({ kind, size: [a, b, c], hull }) {
  switch (kind) {
    case "hull":
      return polyhedron(hull);
    case "box":
      return new THREE.BoxGeometry(2 * a, 2 * b, 2 * c);
    case "ellipsoid":
      return new THREE.SphereGeometry(1, 32, 20).scale(a, b, c);
    case "sphere":
      return new THREE.SphereGeometry(a, 24, 16);
    case "capsule": // three.js's stand along y, MuJoCo's along z
      return new THREE.CapsuleGeometry(a, 2 * b, 8, 20).rotateX(Math.PI / 2);
    default:
      return new THREE.CylinderGeometry(a, a, 2 * b, 28).rotateX(Math.PI / 2);
  }
}

// Triangles with flat faces.
function polyhedron({ points, triangles }) {
  const shape = new THREE.BufferGeometry().setIndex(triangles.flat());
  shape.setAttribute("position", new THREE.Float32BufferAttribute(points.flat(), 3));
  const flat = shape.toNonIndexed();
  flat.computeVertexNormals();
  return flat;
}

export function materials(looks) {
  return Object.fromEntries(
    Object.entries(looks).map(([name, { color, emission, roughness }]) => {
      const shown = new THREE.Color().setRGB(...color, THREE.SRGBColorSpace);
      const glow = { emissive: shown, emissiveIntensity: emission };
      return [name, new THREE.MeshStandardMaterial({ color: shown, roughness, ...glow })];
    }),
  );
}

// A rigid part with its shapes, as Python's `parts` gives it.
function partOf({ name, shapes }, looks) {
  const group = new THREE.Group();
  group.name = name;
  for (const shape of shapes) {
    const mesh = new THREE.Mesh(geometry(shape), looks[shape.material]);
    mesh.position.set(...shape.place);
    mesh.quaternion.copy(quaternion(shape.quaternion));
    mesh.castShadow = mesh.receiveShadow = true;
    group.add(mesh);
  }
  return group;
}

// A body as Python's `parts` gives it: parts hang on one another, from the torso on.
export class Figure {
  constructor(parts, looks) {
    this.parts = parts.map((part) => partOf(part, looks));
    parts.forEach((part, index) => {
      this.parts[index].position.set(...part.place);
      this.parts[index].quaternion.copy(quaternion(part.quaternion));
      if (part.parent !== null) this.parts[part.parent].add(this.parts[index]);
    });
    this.torso = this.parts[0];
    this.owners = parts.map((part, index) => (part.swing ? part.parent : index)); // parts of the simulation
    this.swings = parts.flatMap((part, index) =>
      part.swing ? [{ part: this.parts[index], above: this.parts[part.parent], swing: new Swing(part) }] : [],
    );
    this.hinges = parts.flatMap(({ joint, axis, quaternion: rest }, index) =>
      joint === null ? [] : [{ part: this.parts[index], joint, axis: new THREE.Vector3(...axis), rest: quaternion(rest) }],
    );
  }

  // Turns the joints by angles from the standing pose, rad; the torso is moved by itself.
  bend(angles) {
    const turn = new THREE.Quaternion();
    for (const { part, joint, axis, rest } of this.hinges)
      part.quaternion.copy(rest).multiply(turn.setFromAxisAngle(axis, angles[joint]));
    this.torso.updateMatrixWorld(true);
  }

  // Swings bones of ornaments some seconds on, over ground at a height, m; below 0 seconds they begin at rest.
  swing(seconds, ground = 0) {
    for (const { part, above, swing } of this.swings) {
      part.quaternion.copy(swing.follow(above.matrixWorld, seconds, ground));
      part.updateMatrixWorld(true);
    }
  }
}
