// Plays recorded walks, side by side: bodies from their parts, a timeline, foot contacts and rewards with a cursor.
import * as THREE from "three";
import { drawGait, drawReward, extent, gaitTime, rewardTime } from "./charts.js";
import { unpacked } from "./data.js";
import { grounds, triangles } from "./ground.js";
import { Figure, geometry, materials, quaternion } from "./parts.js";
import { View } from "./view.js";

const DARK = new THREE.MeshStandardMaterial({ color: 0x121214 }); // of a leg whose motors have failed

const SPEEDS = [0.1, 0.25, 0.5, 1, 2];

const byId = (id) => document.getElementById(id);

const meshesOf = (part) => part.children.filter((child) => child.isMesh);

// A body whose parts turn as a walk tells; the frame is MuJoCo's: x ahead, y left, z up.
class Creature extends Figure {
  constructor(walk) {
    super(walk.parts, materials(walk.materials));
    this.walk = walk;
    this.looks = new Map(this.parts.flatMap(meshesOf).map((mesh) => [mesh, mesh.material]));
    this.turns = this.swings.length ? walk.positions.map((_, row) => this.turnsAt(row)) : []; // of bones, in each row
  }

  // Turns of bones that swing in a row of the track, after those of the row before.
  turnsAt(row) {
    const { step, positions, quaternions, scenery } = this.walk;
    this.torso.position.set(...positions[row]);
    this.torso.quaternion.copy(quaternion(quaternions[row]));
    this.torso.updateWorldMatrix(false, false);
    this.swing(row ? step : -1, scenery.level ? 0 : -Infinity);
    return this.swings.map(({ part }) => part.quaternion.clone());
  }

  // Rows of a track stand at the ends of control steps: the first one at `step`.
  row(time) {
    const { step, positions } = this.walk;
    const place = Math.min(Math.max(time / step - 1, 0), positions.length - 1);
    const before = Math.min(Math.floor(place), Math.max(positions.length - 2, 0));
    return { before, after: Math.min(before + 1, positions.length - 1), share: place - before };
  }

  seek(time) {
    const { before, after, share } = this.row(time);
    const { positions, quaternions, joints } = this.walk;
    const mix = (values, index) => (1 - share) * values[before][index] + share * values[after][index];
    this.torso.position.set(...[0, 1, 2].map((axis) => mix(positions, axis)));
    this.torso.quaternion.copy(quaternion(quaternions[before])).slerp(quaternion(quaternions[after]), share);
    this.swings.forEach(({ part }, bone) =>
      part.quaternion.copy(this.turns[before][bone]).slerp(this.turns[after][bone], share),
    );
    this.bend(joints[before].map((_, joint) => mix(joints, joint)));
    const failed = this.walk.scenery.failed[before] ?? [];
    for (const part of this.parts) {
      for (const mesh of meshesOf(part)) mesh.material = failed.includes(part.name) ? DARK : this.looks.get(mesh);
    }
  }

  // Names of the parts that are dark.
  dark() {
    return this.parts.filter((part) => meshesOf(part).some((mesh) => mesh.material === DARK)).map((part) => part.name);
  }

  // Places of all parts in the world by name, and the turns of bones that swing.
  places() {
    const turns = this.swings.map(({ part: { quaternion: { w, x, y, z } } }) => [w, x, y, z]);
    const places = this.parts.map((part) => [part.name, part.getWorldPosition(new THREE.Vector3()).toArray()]);
    return { turns, ...Object.fromEntries(places) };
  }
}

// A view of one creature in its surroundings.
class Stage {
  constructor(walk, canvas) {
    this.creature = new Creature(walk);
    const { height, reach, scenery } = walk;
    this.view = new View(canvas, height, reach, (scenery.level ? 34 : 11) * height);
    this.marks = new Marks(walk.scenery);
    this.view.scene.add(this.creature.torso, this.marks.group, ...surroundings(walk));
    this.creature.seek(0);
    this.view.place(this.target());
  }

  // What the camera is aimed at.
  target() {
    const { x, y, z } = this.creature.torso.position;
    const { height, scenery } = this.creature.walk;
    return new THREE.Vector3(x, y, scenery.level ? 0.45 * height : z - 0.5 * height);
  }

  draw(time) {
    this.creature.seek(time);
    this.marks.seek(this.creature.row(time));
    this.view.follow(this.target());
    this.view.draw();
  }
}

// What is around the creature: floors and steps with tiles on them, fields, obstacles.
function surroundings({ scenery, height, positions }) {
  const ground = grounds(height);
  const path = new THREE.Box2().setFromPoints(positions.map(([x, y]) => new THREE.Vector2(x, y)));
  const middle = path.getCenter(new THREE.Vector2()).divideScalar(height).round().multiplyScalar(height);
  const width = (Math.max(...path.getSize(new THREE.Vector2()).toArray()) / height + 80) * height;
  const solid = ({ kind, size, place, color, shade }) => {
    if (!color) return ground(geometry({ kind, size }), shade, place);
    const look = new THREE.Color().setRGB(...color, THREE.SRGBColorSpace);
    const mesh = new THREE.Mesh(geometry({ kind, size }), new THREE.MeshStandardMaterial({ color: look }));
    mesh.position.set(...place);
    mesh.castShadow = mesh.receiveShadow = true;
    return mesh;
  };
  return [
    ...scenery.planes.map((z) => ground(new THREE.PlaneGeometry(width, width), 1, [middle.x, middle.y, z])),
    ...scenery.fields.map((field) => ground(triangles(field), 1)),
    ...scenery.solids.map(solid),
  ];
}

// What the task asks for: arrows and disks, one mesh for each style.
class Marks {
  constructor({ styles, marks }) {
    this.rows = marks;
    this.group = new THREE.Group();
    this.shown = styles.map(({ shape, radius, color: [red, green, blue, alpha] }) => {
      const look = new THREE.MeshStandardMaterial({ transparent: alpha < 1, opacity: alpha });
      look.color.setRGB(red, green, blue, THREE.SRGBColorSpace);
      const shaft = new THREE.Mesh(new THREE.CylinderGeometry(radius, radius, 1, 32).translate(0, 0.5, 0), look);
      const mark = new THREE.Group().add(shaft);
      if (shape === "arrow") mark.add(new THREE.Mesh(new THREE.ConeGeometry(2 * radius, 1, 24).translate(0, 0.5, 0), look));
      mark.userData.head = 4 * radius;
      this.group.add(mark);
      return mark;
    });
  }

  seek({ before, after, share }) {
    for (const mark of this.shown) mark.visible = false;
    const next = this.rows[after] ?? [];
    for (const [style, ...ends] of this.rows[before] ?? []) {
      const same = next.find(([other]) => other === style);
      // A goal that is reached gives way to the next at once; what goes along with the body does so between rows.
      const moves = same && ends.every((value, index) => Math.abs(same[index + 1] - value) < this.shown[style].userData.head);
      const [x, y, z, ...tip] = moves ? ends.map((value, index) => (1 - share) * value + share * same[index + 1]) : ends;
      this.place(this.shown[style], new THREE.Vector3(x, y, z), new THREE.Vector3(...tip));
    }
  }

  // Where those that are visible begin.
  places() {
    return this.shown.filter((mark) => mark.visible).map((mark) => mark.position.toArray());
  }

  place(mark, start, end) {
    const way = end.clone().sub(start), length = way.length();
    mark.visible = length > 0;
    mark.position.copy(start);
    mark.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), way.normalize());
    const [shaft, cone] = mark.children;
    const head = cone ? Math.min(mark.userData.head, length) : 0;
    shaft.scale.y = Math.max(length - head, 1e-6);
    if (!cone) return;
    cone.position.y = length - head;
    cone.scale.y = Math.max(head, 1e-6);
  }
}

function column(walk) {
  const box = document.createElement("section");
  const drawn = { view: "walk", gait: "foot contacts on the schedule", reward: "weighted terms of the reward" };
  box.innerHTML = "<h2></h2>";
  for (const [name, text] of Object.entries(drawn)) {
    const canvas = Object.assign(document.createElement("canvas"), { className: name, role: "img" });
    canvas.setAttribute("aria-label", `${walk.label}: ${text}`);
    box.append(canvas);
  }
  box.querySelector("h2").textContent = walk.label;
  const [view, gait, reward] = box.querySelectorAll("canvas");
  if (!walk.schedule) gait.remove();
  else gait.style.height = `${Math.min(14 + 15 * walk.legs.length, 200)}px`;
  byId("walks").append(box);
  return { walk, view, gait: walk.schedule && gait, reward, title: box.querySelector("h2") };
}

async function main() {
  const walks = await unpacked(byId("data").textContent);
  const columns = walks.map(column);
  for (const each of columns) each.stage = new Stage(each.walk, each.view);
  const seconds = Math.max(...walks.map((walk) => walk.step * walk.positions.length));
  const extents = walks.map(extent); // one scale, so that walks can be compared
  const scale = [Math.min(...extents.map(([low]) => low)), Math.max(...extents.map(([, high]) => high))];
  const finest = Math.min(...walks.map((walk) => walk.step));
  const state = { time: 0, speed: 1, playing: !window.matchMedia("(prefers-reduced-motion: reduce)").matches };
  const slider = byId("time"), speeds = byId("speed"), button = byId("play");
  slider.max = seconds;
  slider.step = finest / 10;
  for (const speed of SPEEDS) speeds.append(new Option(`${speed}x`, speed, speed === 1, speed === 1));

  const draw = () => {
    for (const { walk, stage, gait, reward, title } of columns) {
      const time = Math.min(state.time, walk.step * walk.positions.length);
      stage.draw(time);
      const row = Math.round(stage.creature.row(time).before + stage.creature.row(time).share);
      if (gait) drawGait(gait, walk, time);
      drawReward(reward, walk, time, row, scale);
      const earned = walk.totals[row];
      title.textContent = `${walk.label}: return ${earned.toFixed(1)} in ${row + 1} steps`;
    }
    slider.value = state.time;
    byId("clock").textContent = `${state.time.toFixed(2)} / ${seconds.toFixed(2)} s`;
    button.textContent = state.playing ? "pause" : "play";
  };
  const seek = (time) => {
    state.time = Math.min(Math.max(time, 0), seconds);
    draw();
  };
  const pause = (playing = !state.playing) => {
    state.playing = playing;
    if (playing && state.time >= seconds) state.time = 0;
    draw();
  };
  const pace = (change) => {
    const index = Math.min(Math.max(SPEEDS.indexOf(state.speed) + change, 0), SPEEDS.length - 1);
    state.speed = SPEEDS[index];
    speeds.value = state.speed;
  };
  const keys = {
    " ": () => pause(),
    ArrowRight: () => (pause(false), seek(state.time + finest)),
    ArrowLeft: () => (pause(false), seek(state.time - finest)),
    ArrowUp: () => pace(1),
    ArrowDown: () => pace(-1),
    Home: () => seek(0),
    End: () => seek(seconds),
  };
  window.addEventListener("keydown", (event) => {
    if (!keys[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    keys[event.key]();
  });
  button.addEventListener("click", () => (button.blur(), pause()));
  slider.addEventListener("input", () => {
    const time = Number(slider.value); // before a drawing sets it
    pause(false);
    seek(time);
  });
  slider.addEventListener("change", () => slider.blur());
  speeds.addEventListener("change", () => ((state.speed = Number(speeds.value)), speeds.blur()));
  for (const { walk, gait, reward } of columns) {
    gait?.addEventListener("click", (event) => seek(gaitTime(gait, event.offsetX, state.time)));
    reward.addEventListener("click", (event) => seek(rewardTime(reward, event.offsetX, walk)));
  }

  let last = null, stale = true; // a page at rest draws only what changes
  for (const { stage } of columns) stage.view.controls.addEventListener("change", () => (stale = true));
  window.addEventListener("resize", () => (stale = true));
  const frame = (now) => {
    if (state.playing && last !== null) {
      state.time += (state.speed * Math.min(now - last, 100)) / 1000;
      if (state.time >= seconds) {
        Object.assign(state, { time: seconds, playing: false });
        stale = true;
      }
    }
    last = now;
    if (state.playing || stale) {
      stale = false;
      draw();
    }
    requestAnimationFrame(frame);
  };
  requestAnimationFrame(frame);
  // For tests, and for whoever steers the page from outside.
  const told = (what) => () => columns.map(({ stage }) => stage[what].places());
  const dark = () => columns.map(({ stage }) => stage.creature.dark());
  window.viewer = { state, seek, pause, places: told("creature"), marks: told("marks"), dark };
}

main();
