// Swings bones of a page's data with a torso, and tells how they are turned: for a test in Node.
// node swings.mjs ENGINE < walks.json > turns.json
import fs from "node:fs";
import * as THREE from "three";
import { quaternion } from "../../web/parts.js";
import { Swing } from "../../web/swinging.js";

const walks = JSON.parse(fs.readFileSync(0, "utf8"));

// Quaternions [w, x, y, z] of a bone at each time of a torso, whose poses are given as [x, y, z, w, x, y, z].
function turns({ bone, times, poses, ground }) {
  const swing = new Swing(bone);
  return poses.map((pose, row) => {
    const matrix = new THREE.Matrix4().makeRotationFromQuaternion(quaternion(pose.slice(3))).setPosition(...pose.slice(0, 3));
    const { w, x, y, z } = swing.follow(matrix, row ? times[row] - times[row - 1] : 0, ground);
    return [w, x, y, z];
  });
}

process.stdout.write(JSON.stringify(walks.map(turns)));
