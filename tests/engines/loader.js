// Opens a clip file with three.js, and tells where its nodes are: for a test in a browser.
import { AnimationMixer, Vector3 } from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";

window.opened = async (base64, times) => {
  const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
  const { scene, animations } = await new GLTFLoader().parseAsync(bytes.buffer, "");
  const mixer = new AnimationMixer(scene);
  const clips = {};
  for (const clip of animations) {
    mixer.stopAllAction();
    const action = mixer.clipAction(clip).play();
    const frames = [];
    for (const share of times) {
      action.time = share * clip.duration;
      mixer.update(0);
      scene.updateMatrixWorld(true);
      const places = {};
      scene.traverse((node) => (places[node.name] = node.getWorldPosition(new Vector3()).toArray()));
      frames.push(places);
    }
    clips[clip.name] = { frames, contacts: clip.userData.foot_contacts.length };
  }
  let bones = 0;
  scene.traverse((node) => (bones += node.isBone ? 1 : 0));
  return { clips, bones };
};
