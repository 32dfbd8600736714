// Ground with tiles on it.
import * as THREE from "three";

const LEVEL = new THREE.Color(1, 1, 1);
const HIGHEST = new THREE.Color(1.9, 1.25, 0.62), LOWEST = new THREE.Color(0.45, 0.65, 0.9);

// Tints of a field's rows by height: as they are at 0, warm above and cold below it.
function tints(heights) {
  const [low, high] = [Math.min, Math.max].map((most) => heights.reduce((found, row) => most(found, ...row), 0));
  const tint = new THREE.Color();
  const shares = (z) => (z < 0 ? [LOWEST, z / low] : [HIGHEST, z / (high || 1)]);
  return (row) => row.flatMap((z) => tint.lerpColors(LEVEL, ...shares(z)).toArray());
}

// A height field, in whose cells MuJoCo's triangles meet from the corner of lowest to that of highest x and y.
export function triangles({ low, cell, heights }) {
  const columns = heights[0].length;
  const points = heights.flatMap((row, j) => row.flatMap((z, i) => [low[0] + i * cell[0], low[1] + j * cell[1], z]));
  const corners = heights.slice(1).flatMap((_, j) =>
    heights[0].slice(1).flatMap((_, i) => {
      const first = j * columns + i;
      const last = first + columns + 1;
      return [first, first + 1, last, first, last, last - 1];
    }),
  );
  const shape = new THREE.BufferGeometry().setIndex(corners);
  shape.setAttribute("position", new THREE.Float32BufferAttribute(points, 3));
  shape.setAttribute("color", new THREE.Float32BufferAttribute(heights.flatMap(tints(heights)), 3));
  shape.computeVertexNormals();
  return shape;
}

// A square tile, which makes motion over the ground visible.
function tiles() {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 128;
  const pen = canvas.getContext("2d");
  pen.fillStyle = "#8d99a6";
  pen.fillRect(0, 0, 128, 128);
  pen.fillStyle = "#5d6875";
  pen.fillRect(1, 1, 126, 126);
  const texture = new THREE.CanvasTexture(canvas);
  texture.colorSpace = THREE.SRGBColorSpace;
  texture.wrapS = texture.wrapT = THREE.RepeatWrapping;
  texture.anisotropy = 8;
  return texture;
}


// Returns a function that makes ground of a shape, in a shade, at a place; tiles are as wide as a body's height.
export function grounds(height) {
  const floor = tiles();
  return (shape, shade, [x, y, z] = [0, 0, 0]) => {
    const places = shape.attributes.position;
    const tile = Array.from({ length: places.count }, (_, index) => [places.getX(index) + x, places.getY(index) + y]);
    shape.setAttribute("uv", new THREE.Float32BufferAttribute(tile.flat().map((side) => side / height), 2));
    const color = new THREE.Color().setScalar(shade);
    const look = { map: floor, color, roughness: 0.95, vertexColors: "color" in shape.attributes };
    const mesh = new THREE.Mesh(shape, new THREE.MeshStandardMaterial(look));
    mesh.position.set(x, y, z);
    mesh.receiveShadow = true;
    return mesh;
  };
}
