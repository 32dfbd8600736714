// Plays recorded walks, side by side: bodies from their parts, a timeline, foot contacts and rewards with a cursor.
import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2];
const WINDOW = 4; // s of foot contacts
const VIEW = (35 / 180) * Math.PI; // angle of the camera
const INK = "#d7dde5", FAINT = "#8791a0", PALE = "#39424f", BLUE = "#3b9be0", VERMILION = "#f0713a";

const byId = (id) => document.getElementById(id);

async function unpacked(text) {
  const bytes = Uint8Array.from(atob(text.trim()), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return JSON.parse(await new Response(stream).text());
}

const quaternion = ([w, x, y, z]) => new THREE.Quaternion(x, y, z, w);

function geometry({ kind, size: [a, b, c] }) {
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

function materials(looks) {
  return Object.fromEntries(
    Object.entries(looks).map(([name, { colour, emission, roughness }]) => {
      const shown = new THREE.Color().setRGB(...colour, THREE.SRGBColorSpace);
      const glow = { emissive: shown, emissiveIntensity: emission };
      return [name, new THREE.MeshStandardMaterial({ color: shown, roughness, ...glow })];
    }),
  );
}

// A body whose parts turn as a walk tells; the frame is MuJoCo's: x ahead, y left, z up.
class Creature {
  constructor(walk) {
    this.walk = walk;
    const looks = materials(walk.materials);
    this.parts = walk.parts.map((part) => {
      const group = new THREE.Group();
      group.name = part.name;
      group.position.set(...part.place);
      group.quaternion.copy(quaternion(part.quaternion));
      for (const shape of part.shapes) {
        const mesh = new THREE.Mesh(geometry(shape), looks[shape.material]);
        mesh.position.set(...shape.place);
        mesh.quaternion.copy(quaternion(shape.quaternion));
        mesh.castShadow = mesh.receiveShadow = true;
        group.add(mesh);
      }
      return group;
    });
    walk.parts.forEach((part, index) => part.parent !== null && this.parts[part.parent].add(this.parts[index]));
    this.torso = this.parts[0];
    this.axes = walk.parts.map((part) => part.axis && new THREE.Vector3(...part.axis));
    this.rests = walk.parts.map((part) => quaternion(part.quaternion));
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
    const { positions, quaternions, joints, parts } = this.walk;
    const mix = (values, index) => (1 - share) * values[before][index] + share * values[after][index];
    this.torso.position.set(...[0, 1, 2].map((axis) => mix(positions, axis)));
    this.torso.quaternion.copy(quaternion(quaternions[before])).slerp(quaternion(quaternions[after]), share);
    const turn = new THREE.Quaternion();
    parts.forEach((part, index) => {
      if (part.joint === null) return;
      turn.setFromAxisAngle(this.axes[index], mix(joints, part.joint));
      this.parts[index].quaternion.copy(this.rests[index]).multiply(turn);
    });
    this.torso.updateMatrixWorld(true);
  }

  // Places of all parts in the world by name.
  places() {
    return Object.fromEntries(this.parts.map((part) => [part.name, part.getWorldPosition(new THREE.Vector3()).toArray()]));
  }
}

// A view of one creature, whose camera goes along and can be turned about it.
class Stage {
  constructor(walk, canvas) {
    this.canvas = canvas;
    this.creature = new Creature(walk);
    const height = walk.height;
    this.scene = new THREE.Scene();
    this.scene.background = new THREE.Color("#a3adb8");
    this.away = new THREE.Vector3(1.9, -2.6, 1.1).multiplyScalar(1.5 * walk.reach); // of the camera
    const away = this.away.length(); // the ground is there for 12 heights about the way, a plane for more
    this.scene.fog = new THREE.Fog("#a3adb8", away + 3 * height, away + (walk.scenery.level ? 34 : 11) * height);
    this.marks = new Marks(walk.scenery);
    this.scene.add(this.creature.torso, this.marks.group, new THREE.HemisphereLight("#dfe8f2", "#56606c", 1.6));
    this.sun = new THREE.DirectionalLight("#fff4e6", 2.4);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(1024, 1024);
    const reach = 2.5 * walk.reach;
    Object.assign(this.sun.shadow.camera, { left: -reach, right: reach, top: reach, bottom: -reach, far: 20 * reach });
    this.sun.shadow.normalBias = 0.01 * height;
    this.offset = new THREE.Vector3(-0.3, 0.5, 1.2).setLength(6 * reach);
    this.scene.add(this.sun, this.sun.target, ...surroundings(walk));
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
    this.renderer.shadowMap.enabled = true;
    this.renderer.setPixelRatio(window.devicePixelRatio);
    this.camera = new THREE.PerspectiveCamera(35, 1, 0.02 * height, 100 * height);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.maxPolarAngle = 0.49 * Math.PI;
    this.creature.seek(0);
    this.target = new THREE.Vector3();
    this.aim(this.target);
    this.camera.position.copy(this.target).add(this.away);
    this.controls.target.copy(this.target);
    this.controls.update();
  }

  aim(target) {
    const { x, y, z } = this.creature.torso.position;
    const { height, scenery } = this.creature.walk;
    return target.set(x, y, scenery.level ? 0.45 * height : z - 0.5 * height);
  }

  draw(time) {
    this.creature.seek(time);
    this.marks.seek(this.creature.row(time));
    const before = this.target.clone();
    const way = this.aim(this.target).clone().sub(before);
    this.camera.position.add(way);
    this.controls.target.add(way);
    this.controls.update();
    this.sun.target.position.copy(this.target);
    this.sun.position.copy(this.target).add(this.offset);
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const size = this.renderer.getSize(new THREE.Vector2());
    if (size.x !== width || size.y !== height) {
      this.renderer.setSize(width, height, false);
      this.camera.aspect = width / height;
      // In a narrow view the creature is as far from the sides as it is from top and bottom in a wide one.
      this.camera.fov = 2 * Math.atan(Math.tan(VIEW / 2) * Math.max(1, height / width)) * (180 / Math.PI);
      this.camera.updateProjectionMatrix();
    }
    this.renderer.render(this.scene, this.camera);
  }
}

// What is around the creature: floors and steps with tiles on them, fields, obstacles.
function surroundings({ scenery, height, positions }) {
  const floor = tiles();
  const material = (shade) =>
    new THREE.MeshStandardMaterial({ map: floor, color: new THREE.Color().setScalar(shade), roughness: 0.95 });
  const ground = (shape, shade, [x, y, z] = [0, 0, 0]) => {
    const places = shape.attributes.position;
    const tile = Array.from({ length: places.count }, (_, index) => [places.getX(index) + x, places.getY(index) + y]);
    shape.setAttribute("uv", new THREE.Float32BufferAttribute(tile.flat().map((way) => way / height), 2));
    const mesh = new THREE.Mesh(shape, material(shade));
    mesh.position.set(x, y, z);
    mesh.receiveShadow = true;
    return mesh;
  };
  const path = new THREE.Box2().setFromPoints(positions.map(([x, y]) => new THREE.Vector2(x, y)));
  const middle = path.getCenter(new THREE.Vector2()).divideScalar(height).round().multiplyScalar(height);
  const width = (Math.max(...path.getSize(new THREE.Vector2()).toArray()) / height + 80) * height;
  const solid = ({ kind, size, place, colour, shade }) => {
    if (!colour) return ground(geometry({ kind, size }), shade, place);
    const look = new THREE.Color().setRGB(...colour, THREE.SRGBColorSpace);
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

// A height field, in whose cells MuJoCo's triangles meet from the corner of lowest to that of highest x and y.
function triangles({ low, cell, heights }) {
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
  shape.computeVertexNormals();
  return shape;
}

// What the task asks for: arrows and discs, one mesh for each style.
class Marks {
  constructor({ styles, marks }) {
    this.rows = marks;
    this.group = new THREE.Group();
    this.shown = styles.map(({ shape, radius, colour: [red, green, blue, alpha] }) => {
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

function sized(canvas) {
  const scale = window.devicePixelRatio;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * scale) || canvas.height !== Math.round(height * scale)) {
    canvas.width = Math.round(width * scale);
    canvas.height = Math.round(height * scale);
  }
  const pen = canvas.getContext("2d");
  pen.setTransform(scale, 0, 0, scale, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.font = "11px system-ui, sans-serif";
  pen.textBaseline = "middle";
  return { pen, width, height };
}

const LEFT = 58, RIGHT = 150; // px, for names of legs and for terms

// Bars of stance by leg on the prescribed schedule, some seconds about the cursor.
function drawGait(canvas, walk, time) {
  const { pen, width, height } = sized(canvas);
  const rows = walk.legs.length, pitch = (height - 4) / rows, scale = (width - LEFT - 8) / WINDOW;
  const start = time - WINDOW / 2;
  const bar = (first, last, row, share, colour) => {
    const from = Math.max(LEFT, LEFT + (first * walk.step - start) * scale);
    const to = Math.min(width - 8, LEFT + (last * walk.step - start) * scale);
    if (to <= from) return;
    pen.fillStyle = colour;
    pen.fillRect(from, 2 + (row + (1 - share) / 2) * pitch, to - from + 0.5, share * pitch); // without seams
  };
  walk.legs.forEach((leg, row) => {
    pen.fillStyle = INK;
    pen.fillText(leg, 4, 2 + (row + 0.5) * pitch);
    const first = Math.max(0, Math.floor(start / walk.step) - 1);
    const last = Math.min(walk.positions.length, Math.ceil((start + WINDOW) / walk.step) + 1);
    const steps = Array.from({ length: Math.max(0, last - first) }, (_, index) => first + index);
    for (const k of steps) if (walk.schedule[k][row]) bar(k, k + 1, row, 0.84, PALE);
    for (const k of steps) if (walk.stance[k][row]) bar(k, k + 1, row, 0.4, walk.schedule[k][row] ? BLUE : VERMILION);
  });
  pen.fillStyle = "#ffffff";
  pen.fillRect(LEFT + (WINDOW / 2) * scale - 0.5, 0, 1, height);
}

// Weighted terms of the reward, gains stacked upwards and costs downwards, with their values at the cursor.
function drawReward(canvas, walk, time, row, [bottom, top]) {
  const { pen, width, height } = sized(canvas);
  const names = Object.keys(walk.terms), count = walk.positions.length;
  const scale = (width - LEFT - RIGHT) / count;
  const y = (value) => 6 + ((top - value) / (top - bottom)) * (height - 12);
  for (let k = 0; k < count; k += 1) {
    let up = 0, down = 0;
    for (const name of names) {
      const value = walk.terms[name][k], from = value > 0 ? up : down;
      pen.fillStyle = walk.colours[name];
      pen.fillRect(LEFT + k * scale, Math.min(y(from), y(from + value)), scale + 0.6, Math.abs(y(from) - y(from + value)));
      if (value > 0) up += value;
      else down += value;
    }
  }
  pen.fillStyle = INK;
  pen.textAlign = "right";
  for (const value of [0, Math.floor(top)]) pen.fillText(value.toFixed(0), LEFT - 6, y(value));
  pen.textAlign = "left";
  pen.fillText("reward", 4, height / 2);
  pen.fillStyle = "#ffffff";
  pen.fillRect(LEFT + Math.min(time / walk.step, count) * scale - 0.5, 0, 1, height);
  names.forEach((name, index) => {
    const line = 8 + (index * (height - 16)) / Math.max(names.length - 1, 1);
    pen.fillStyle = walk.colours[name];
    pen.fillRect(width - RIGHT + 8, line - 4, 8, 8);
    pen.fillStyle = INK;
    pen.fillText(name.replaceAll("_", " "), width - RIGHT + 20, line);
    pen.textAlign = "right";
    pen.fillText(walk.terms[name][row].toFixed(2).replace(/^-(?=0.00$)/, ""), width - 4, line);
    pen.textAlign = "left";
  });
}

// The least and the greatest of what costs and gains add up to in any step.
function extent(walk) {
  const sums = (part) => walk.totals.map((_, k) => Object.values(walk.terms).reduce((sum, term) => sum + part(0, term[k]), 0));
  return [Math.min(...sums(Math.min), 0), Math.max(...sums(Math.max), 1e-9)];
}

function column(walk) {
  const box = document.createElement("section");
  box.innerHTML = `<h2></h2><canvas class="view"></canvas><canvas class="gait"></canvas><canvas class="reward"></canvas>`;
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
  const state = { time: 0, speed: 1, playing: true };
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
    const clicked = (canvas, toTime) =>
      canvas?.addEventListener("click", (event) => seek(toTime(event.offsetX, canvas.clientWidth)));
    clicked(gait, (x, width) => state.time + ((x - LEFT) / (width - LEFT - 8) - 0.5) * WINDOW);
    clicked(reward, (x, width) => ((x - LEFT) / (width - LEFT - RIGHT)) * walk.step * walk.positions.length);
  }

  let last = null, stale = true; // a page at rest draws only what changes
  for (const { stage } of columns) stage.controls.addEventListener("change", () => (stale = true));
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
  window.viewer = { state, seek, pause, places: told("creature"), marks: told("marks") };
}

main();
