// Shade of the ground near spheres above it: the share of the sky that they hide.
import * as THREE from "three";

const DEPTH = 0.9; // of the shade, at most

const SHADE = `
float hidden = 0.0;
if (distance(place.xy, spheres[0].xy) < far) for (int i = 0; i < COUNT; i++) {
  vec3 way = spheres[i].xyz - place;
  float within = spheres[i].w * spheres[i].w, near = max(dot(way, way), within);
  hidden += max(way.z, 0.0) * within * inversesqrt(near) / near;
}
outgoingLight *= 1.0 - ${DEPTH} * min(hidden, 1.0);
#include <opaque_fragment>`;

// Adds the shade to a material; returns its spheres, [x, y, z, radius] in m, around the first of them.
export function contact(material, count, far) {
  const spheres = Array.from({ length: count }, () => new THREE.Vector4());
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, { spheres: { value: spheres }, far: { value: far } });
    shader.vertexShader = `varying vec3 place;\n${shader.vertexShader}`.replace(
      "#include <project_vertex>",
      "#include <project_vertex>\nplace = (modelMatrix * vec4(transformed, 1.0)).xyz;",
    );
    const declared = `#define COUNT ${count}\nuniform vec4 spheres[COUNT];\nuniform float far;\nvarying vec3 place;\n`;
    shader.fragmentShader = declared + shader.fragmentShader.replace("#include <opaque_fragment>", SHADE);
  };
  return spheres;
}

// Half of a part's breadth, m, without the parts that hang on it.
export function breadth(part) {
  const box = new THREE.Box3();
  for (const mesh of part.children.filter((child) => child.isMesh)) {
    mesh.geometry.computeBoundingBox();
    mesh.updateMatrix();
    box.union(mesh.geometry.boundingBox.clone().applyMatrix4(mesh.matrix));
  }
  return box.isEmpty() ? 0 : (box.max.x - box.min.x + box.max.y - box.min.y) / 4;
}
