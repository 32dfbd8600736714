// A page to play in: MuJoCo steps a body, a policy drives it, the player commands it.
import loadMujoco from "@mujoco/mujoco";
import * as THREE from "three";
import { Chase } from "./chase.js";
import { Choice } from "./choice.js";
import { breadth, contact } from "./contact.js";
import { bytes, unpacked, whole } from "./data.js";
import { Goals } from "./goals.js";
import { grounds, triangles } from "./ground.js";
import { Inputs } from "./inputs.js";
import { follow, keep, names } from "./link.js";
import { Kick } from "./kick.js";
import { Panel } from "./panel.js";
import { Figure, materials, quaternion } from "./parts.js";
import { Ring } from "./ring.js";
import { Simulation } from "./simulation.js";
import { Sound } from "./sound.js";
import { Steps } from "./steps.js";
import { Traces } from "./traces.js";
import { View } from "./view.js";

const RESTART = 1.5; // s that a fallen body lies
const GIVE_UP = 8; // s that a body has for getting up
const BUSY = 20; // ms of a picture's time for physics: a slower machine shows slow motion
const BUSY_SHARE = 0.5; // of the time since the last picture, which physics may take where pictures are slow
const AWAY = 2; // s between two pictures after which the page was hidden, and goes on as it was
const PACE_SECONDS = 0.33; // s over which the pace is averaged
const LIFTED = 1.3; // standing heights of a torso, from which the camera follows it up

const TINTS = ["#ffffff", "#5f8dcf"]; // of the player's body and of the other

const byId = (id) => document.getElementById(id);

function tinted(looks, tint) {
  const made = materials(looks);
  for (const { color } of Object.values(made)) color.multiply(new THREE.Color(tint));
  return made;
}

// A body on some ground, as it is simulated and drawn.
class Play {
  constructor(mujoco, body, ground, mode, canvas, sound, name) {
    this.simulation = new Simulation(mujoco, body, ground, mode === "rival" ? 2 : 1);
    const { height } = body, { field } = this.simulation;
    this.body = body;
    this.view = new View(canvas, height, body.reach, (field ? 20 : 34) * height);
    const made = grounds(height);
    const looks = this.simulation.shares.map((_, number) => tinted(body.materials, TINTS[number]));
    this.figures = looks.map((each) => new Figure(body.parts, each));
    [this.figure] = this.figures;
    this.parts = this.figure.parts;
    this.floor = made(field ? triangles(field) : new THREE.PlaneGeometry(100 * height, 100 * height), 1);
    this.spheres = contact(this.floor.material, 1 + body.feet.length, 2 * body.reach);
    this.spheres[0].w = 0.8 * breadth(this.parts[0]);
    this.steps = new Steps(body, this.parts);
    this.traces = new Traces(height, this.simulation.task.ground);
    this.goals = new Goals(height, body.reach, this.simulation.task.ground, `best time of ${name}`);
    const { center, task } = this.simulation;
    this.ring = mode === "rival" ? new Ring(center, body.reach, height, task.ground) : null;
    if (mode === "goals") this.goals.begin();
    this.sound = sound;
    const rope = new THREE.BufferGeometry().setFromPoints([new THREE.Vector3(), new THREE.Vector3(1, 1, 1)]);
    this.rope = new THREE.Line(rope, new THREE.LineBasicMaterial({ color: "#ffd23f", depthTest: false }));
    this.rope.frustumCulled = false;
    const added = [this.floor, this.rope, this.traces.group, this.goals.group];
    if (this.ring) added.push(this.ring.group);
    this.view.scene.add(...this.figures.map(({ torso }) => torso), ...added);
    this.debt = 0; // s of simulation that are due
    this.lain = 0; // s since a fall
    this.down = 0; // s since that of the other body
    this.pace = 1; // share of real time
    this.shown = 0; // s of the simulation in the latest picture
    this.pose();
    this.view.place(this.target());
    this.chase = new Chase(this.view);
    this.chase.follow(this.heading);
  }

  // rad
  get heading() {
    return this.simulation.task.place[2];
  }

  restart() {
    this.ring?.begin();
    this.place();
    if (this.goals.number !== null) this.goals.begin();
  }

  // Puts all bodies where they started.
  place() {
    this.simulation.release();
    this.simulation.restart(undefined, undefined, this.ring?.turns);
    this.lain = this.down = this.debt = 0;
    this.chase.on = true;
    this.chase.follow(this.heading);
    this.steps.begin();
    this.traces.clear();
  }

  // Steps through some seconds of real time, as far as some milliseconds allow.
  advance(seconds, asked, budget = Math.max(BUSY, 1000 * BUSY_SHARE * seconds)) {
    const { simulation, body } = this, began = performance.now();
    this.debt += seconds;
    let stepped = 0;
    while (this.debt >= body.timestep && performance.now() - began < budget) {
      simulation.substep(asked);
      this.debt -= body.timestep;
      stepped += body.timestep;
    }
    if (this.debt >= body.timestep) this.debt = 0;
    const share = 1 - Math.exp(-seconds / PACE_SECONDS); // of the new pace in the mean
    if (seconds > 0) this.pace += share * (Math.min(stepped / seconds, 1) - this.pace);
    if (!simulation.pull) {
      this.goals.advance(stepped, simulation.task.place);
      if (this.ring?.advance(stepped, simulation.minds.map(({ task }) => task.place))) this.place();
    }
    this.lain = simulation.fell ? this.lain + stepped : 0;
    this.down = simulation.minds[1]?.fell ? this.down + stepped : 0;
    const most = body.recovery ? GIVE_UP : RESTART;
    if (this.lain >= most) this.lose(0);
    else if (this.down >= most) this.lose(1);
  }

  // Starts anew as a body cannot get up, by number; in a ring the other one scores.
  lose(number) {
    if (!this.ring) return this.restart();
    this.ring.win(1 - number);
    this.place();
  }

  pose() {
    const { joints, home } = this.body.task, { time } = this.simulation.data;
    this.figures.forEach(({ torso }, number) => {
      const { qpos } = this.simulation.shares[number](), { task } = this.simulation.minds[number];
      torso.position.fromArray(task.torso(qpos, qpos.subarray(3, 7)));
      torso.quaternion.copy(quaternion(qpos.subarray(3, 7)));
      this.figures[number].bend(joints.map((place, joint) => qpos[place] - home[joint]));
      const { x, y } = torso.position;
      this.figures[number].swing(time - this.shown, this.simulation.ground(x, y));
    });
    this.shown = time;
    const { pull } = this.simulation;
    this.rope.visible = pull !== null;
    if (pull) this.rope.geometry.setFromPoints([pull.point, pull.target].map((point) => new THREE.Vector3(...point)));
    this.goals.show(this.parts[0].position);
  }

  // Shows the steps of some seconds.
  walk(seconds) {
    const { simulation, steps, traces, body: { height } } = this, [torso, ...feet] = this.spheres;
    for (const { place, radius, strength } of steps.read(simulation, seconds)) {
      traces.add(place, radius, strength);
      this.sound.step(strength, height);
    }
    traces.advance(seconds);
    torso.set(...this.parts[0].position, torso.w);
    feet.forEach((sphere, index) => sphere.set(...steps.feet[index].place, 1.5 * steps.feet[index].radius));
  }

  target() {
    const { x, y, z } = this.parts[0].position, { height } = this.body;
    const ground = this.simulation.task.ground(x, y), lifted = Math.max(z - ground - LIFTED * height, 0);
    return new THREE.Vector3(x, y, ground + 0.45 * height + lifted);
  }

  // Draws some seconds after the last time, with the rates at which the player turns the camera.
  draw(seconds = 0, camera = [0, 0]) {
    this.pose();
    this.walk(seconds);
    const target = this.target(), { height } = this.body;
    this.view.follow(target);
    if (!this.simulation.pull) this.chase.follow(this.heading, seconds);
    this.chase.steer(camera, seconds);
    // A plane goes along by whole tiles.
    if (!this.simulation.field) for (const axis of ["x", "y"]) this.floor.position[axis] = Math.round(target[axis] / height) * height;
    this.view.draw();
  }

  // Kicks the body away from the camera, by a share of its largest kick.
  kick(share) {
    const way = this.view.target.clone().sub(this.view.camera.position).setZ(0);
    way.setLength(share * this.body.kick);
    this.simulation.kick([way.x, way.y]);
  }

  // Takes hold of the part under the pointer; returns a function that drags it to another place, or null.
  grab(place) {
    const ray = new THREE.Raycaster();
    const aim = ({ x, y }) => ray.setFromCamera(new THREE.Vector2(x, y), this.view.camera);
    aim(place);
    const [hit] = ray.intersectObject(this.figure.torso, true);
    if (!hit) return null;
    const index = this.figure.owners[this.parts.indexOf(hit.object.parent)];
    const facing = this.view.camera.getWorldDirection(new THREE.Vector3());
    const plane = new THREE.Plane().setFromNormalAndCoplanarPoint(facing, hit.point);
    this.simulation.grab(index, hit.point.toArray());
    return (next) => {
      aim(next);
      const point = ray.ray.intersectPlane(plane, new THREE.Vector3());
      if (point && this.simulation.pull) this.simulation.pull.target = point.toArray();
    };
  }

  free() {
    this.view.free();
    this.simulation.free();
  }
}

// Dragging a part pulls it; dragging elsewhere turns the camera, by controls that listen later.
function pulls(canvas, current) {
  let drag = null;
  const place = ({ offsetX, offsetY }) => ({
    x: (2 * offsetX) / canvas.clientWidth - 1,
    y: 1 - (2 * offsetY) / canvas.clientHeight,
  });
  canvas.addEventListener(
    "pointerdown",
    (event) => {
      if (drag || event.button !== 0 || !(drag = current().grab(place(event)))) return;
      event.stopImmediatePropagation();
      canvas.setPointerCapture(event.pointerId);
    },
    { capture: true },
  );
  canvas.addEventListener("pointermove", (event) => drag?.(place(event)));
  for (const end of ["pointerup", "pointercancel"])
    canvas.addEventListener(end, () => {
      if (drag) current().simulation.release();
      drag = null;
    });
}

function shown({ simulation, body, pace, goals, ring }, command, gait, playing) {
  const { motion } = simulation.task, { units } = body.task;
  const speed = Math.hypot(motion[0] * units[0], motion[1] * units[1]);
  const asked = body.task.headed
    ? `forward ${command[0].toFixed(1)}, left ${command[1].toFixed(1)}, turn ${command[2].toFixed(1)}`
    : `course ${((simulation.task.course * 180) / Math.PI).toFixed(0)} degrees`;
  const states = {
    paused: !playing,
    held: simulation.pull,
    landing: simulation.landing,
    "getting up": simulation.minds[0].rises,
    fallen: simulation.fell,
    [`slow motion, ${pace.toFixed(1)} of real time`]: pace < 0.9,
  };
  const state = Object.keys(states).find((name) => states[name]);
  return [String(goals), String(ring ?? ""), `${speed.toFixed(2)} m/s`, asked, gait, state].filter(Boolean).join(" \u00b7 ");
}

async function main() {
  const [{ bodies, shared }, wasmBinary] = await Promise.all([
    unpacked(byId("data").textContent),
    bytes(byId("engine").textContent),
  ]);
  const mujoco = await loadMujoco({ wasmBinary });
  const inputs = new Inputs(byId("stick"), [byId("left"), byId("right")]);
  const panel = new Panel(byId("direction")), sound = new Sound(), kick = new Kick();
  const state = { playing: true, play: null, stale: true }; // a page at rest draws only what changes
  const [list, legs, links, ground, mode] = ["body", "legs", "links", "ground", "mode"].map(byId);
  const controls = [list, legs, links, ground, mode];
  const choice = new Choice(list, [legs, links], bodies);
  Object.keys(bodies[0].grounds).forEach((name) => ground.append(new Option(name)));
  byId("help").open = window.innerWidth > 700 && window.innerHeight > 500;
  panel.element.open = byId("help").open && window.innerWidth > 1000 && !inputs.shows;

  const change = () => {
    state.play?.free();
    const old = document.querySelector("canvas"), canvas = old.cloneNode(); // with a context of its own
    old.replaceWith(canvas);
    const { body } = choice;
    const name = `${body.name} on ${ground.value} ground`;
    state.play = new Play(mujoco, body, whole(body.grounds[ground.value], shared), mode.value, canvas, sound, name);
    canvas.setAttribute("aria-label", name);
    pulls(canvas, () => state.play);
    panel.offer(body.task.direction);
    for (const each of document.querySelectorAll(".directed")) each.hidden = !body.task.direction;
    for (const each of document.querySelectorAll(".running")) each.hidden = !body.task.direction?.run;
    const leaps = Object.keys(body.policy.constants.leaps ?? {});
    for (const each of document.querySelectorAll(".leaping")) each.hidden = !leaps.length;
    byId("leap").textContent = leaps[0] ?? "";
    byId("leaps").textContent = leaps.join(", while walking ");
    const stale = () => (state.stale = true);
    state.play.view.controls.addEventListener("change", stale);
    stale();
  };
  const pause = (playing = !state.playing) => {
    Object.assign(state, { playing, stale: true });
    byId("pause").textContent = playing ? "pause" : "go on";
  };
  const actions = {
    leap: () => state.play.simulation.leap(),
    kick: () => kick.begin(), // until it is let go
    run: () => {
      inputs.running = !inputs.running;
      byId("run").setAttribute("aria-pressed", inputs.running);
    },
    restart: () => (state.play.restart(), (state.stale = true)),
    pause: () => pause(),
    sound: () => {
      sound.on = !sound.on;
      byId("sound").textContent = sound.on ? "mute" : "sound";
    },
  };
  const letGo = () => {
    if (kick.start !== null) state.play.kick(kick.end());
    byId("kick").style.removeProperty("--share");
  };
  const { leap, restart, sound: hush } = actions;
  const keys = { Space: leap, KeyB: actions.kick, KeyR: restart, KeyP: actions.pause, KeyM: hush };
  Object.assign(keys, { Digit0: () => panel.reset(), Comma: () => panel.quicken(-1), Period: () => panel.quicken(1) });
  for (let number = 1; number < 10; number += 1) keys[`Digit${number}`] = () => panel.choose(number);
  window.addEventListener("resize", () => (state.stale = true));
  for (const [name, act] of Object.entries(actions))
    byId(name).addEventListener("click", (event) => {
      if (name !== "kick" || !event.detail) act(); // pointers hold it
      if (name === "kick") letGo();
      if (event.detail) event.target.blur(); // by a pointer: keys are the body's
    });
  byId("kick").addEventListener("pointerdown", actions.kick);
  for (const end of ["pointerup", "pointerleave", "pointercancel"]) byId("kick").addEventListener(end, letGo);
  window.addEventListener("keyup", (event) => event.code === "KeyB" && letGo());
  window.addEventListener("blur", letGo);
  for (const control of controls) {
    follow(control);
    control.addEventListener("change", () => {
      if (control.type !== "range") control.blur();
      choice.tell();
      keep(controls);
      change();
    });
  }
  if (names("legs") && !names("body")) choice.count();
  choice.tell();
  window.addEventListener("keydown", (event) => {
    const act = keys[event.code];
    const used = event.code === "Space" && event.target.closest("button, select, summary"); // pressed by the space bar
    if (!act || used || event.repeat || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    act();
  });
  change();

  let last = null;
  const frame = (now) => {
    const since = last === null ? 0 : (now - last) / 1000;
    const seconds = since > AWAY ? 0 : since;
    last = now;
    const asked = panel.asked(inputs.command, inputs.pose, inputs.runs);
    for (const name of inputs.pushes()) actions[name]();
    const holds = inputs.holds("kick");
    if (state.padHeld && !holds) letGo();
    state.padHeld = holds;
    if (kick.start !== null) byId("kick").style.setProperty("--share", kick.share);
    if (state.playing) state.play.advance(seconds, asked);
    panel.tell(asked);
    const { camera } = inputs;
    if (state.playing || state.stale || camera.some(Boolean)) {
      state.stale = false;
      state.play.draw(seconds, camera);
      byId("state").textContent = shown(state.play, asked.command, panel.gait, state.playing);
    }
    requestAnimationFrame(frame);
  };
  requestAnimationFrame(frame);
  document.body.classList.remove("loading");
  window.play = { state, inputs, panel, pause, sound, kick }; // for tests
}

main().catch((error) => (byId("loading").textContent = `This browser cannot play: ${error.message}`));
