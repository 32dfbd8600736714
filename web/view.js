// A view of a creature outdoors, whose camera goes along and can be turned about it.
import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";

const ANGLE = (35 / 180) * Math.PI; // of the camera

export class View {
  // Takes a canvas, the standing height of a body, how far it reaches, and how far one sees from there, m.
  constructor(canvas, height, reach, sight) {
    this.canvas = canvas;
    this.scene = new THREE.Scene();
    this.scene.background = new THREE.Color("#a3adb8");
    this.away = new THREE.Vector3(1.9, -2.6, 1.1).multiplyScalar(1.5 * reach); // of the camera
    const away = this.away.length();
    this.scene.fog = new THREE.Fog("#a3adb8", away + 3 * height, away + sight);
    this.scene.add(new THREE.HemisphereLight("#dfe8f2", "#56606c", 1.6));
    this.sun = new THREE.DirectionalLight("#fff4e6", 2.4);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(1024, 1024);
    this.sun.shadow.radius = 2.5;
    const side = 2.5 * reach;
    Object.assign(this.sun.shadow.camera, { left: -side, right: side, top: side, bottom: -side, far: 20 * side });
    this.sun.shadow.normalBias = 0.01 * height;
    this.offset = new THREE.Vector3(-0.3, 0.5, 1.2).setLength(6 * side);
    this.scene.add(this.sun, this.sun.target);
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
    this.renderer.shadowMap.enabled = true;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2)); // more cannot be told apart
    this.camera = new THREE.PerspectiveCamera(35, 1, 0.02 * height, 100 * height);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.maxPolarAngle = 0.49 * Math.PI;
    this.target = new THREE.Vector3();
  }

  // Puts the camera at its distance from a target.
  place(target) {
    this.target.copy(target);
    this.camera.position.copy(target).add(this.away);
    this.controls.target.copy(target);
    this.controls.update();
  }

  // Moves the camera along with a target.
  follow(target) {
    const moved = target.clone().sub(this.target);
    this.target.copy(target);
    this.camera.position.add(moved);
    this.controls.target.add(moved);
    this.controls.update();
    this.sun.target.position.copy(target);
    this.sun.position.copy(target).add(this.offset);
  }

  draw() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (this.width !== width || this.height !== height) {
      Object.assign(this, { width, height });
      this.renderer.setSize(width, height, false);
      this.camera.aspect = width / height;
      // In a narrow view the creature is as far from the sides as it is from top and bottom in a wide one.
      this.camera.fov = 2 * Math.atan(Math.tan(ANGLE / 2) * Math.max(1, height / width)) * (180 / Math.PI);
      this.camera.updateProjectionMatrix();
    }
    this.renderer.render(this.scene, this.camera);
  }

  // Frees what the graphics card holds.
  free() {
    this.scene.traverse(({ geometry, material }) => (geometry?.dispose(), material?.dispose()));
    this.controls.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss(); // a page may have a few at a time
  }
}
