// Parts of a body: shapes and materials in MuJoCo's terms, as three.js draws them.
import * as THREE from "three";

export const quaternion = ([w, x, y, z]) => new THREE.Quaternion(x, y, z, w);

export function geometry({ kind, size: [a, b, c] }) {
  switch (kind) {
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

export function materials(looks) {
  return Object.fromEntries(
    Object.entries(looks).map(([name, { colour, emission, roughness }]) => {
      const shown = new THREE.Color().setRGB(...colour, THREE.SRGBColorSpace);
      const glow = { emissive: shown, emissiveIntensity: emission };
      return [name, new THREE.MeshStandardMaterial({ color: shown, roughness, ...glow })];
    }),
  );
}

// A rigid part with its shapes, as Python's `parts` gives it.
export function partOf({ name, shapes }, looks) {
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
