// Runs bodies of a page in MuJoCo's WebAssembly, and tells where they go: for a test in Node.
// node closed_loop.mjs ENGINE < episodes.json > paths.json
import fs from "node:fs";
import zlib from "node:zlib";
import loadMujoco from "@mujoco/mujoco";
import { Simulation } from "../../web/simulation.js";

const episodes = JSON.parse(fs.readFileSync(0, "utf8"));
const mujoco = await loadMujoco({ wasmBinary: zlib.inflateSync(fs.readFileSync(process.argv[2])) });

// Positions, actions and falls at the ends of control steps, and observations before their beginnings. Actions that are
// given are applied in place of the policy's. A body that rises gets up from the start on.
function path({ creature, ground, qpos, qvel, desired, asked, replayed, rises }) {
  const simulation = new Simulation(mujoco, creature, creature.grounds[ground]);
  simulation.restart(qpos, qvel);
  const { data, task, minds: [{ recovery }] } = simulation, driver = rises ? recovery.driver : simulation.driver;
  if (rises) recovery.on = true;
  task.desired = desired;
  const act = driver.act.bind(driver);
  const positions = [], actions = [], observations = [], falls = [];
  driver.act = (observation) => {
    observations.push(observation);
    actions.push(act(observation));
    return replayed ? replayed[actions.length - 1] : actions.at(-1);
  };
  for (const each of asked) {
    if (each.leaps) simulation.leap();
    if (each.kick) simulation.kick(each.kick);
    for (let count = 0; count < creature.substeps; count += 1) simulation.substep(each);
    positions.push([...data.qpos]);
    falls.push(task.fell);
  }
  simulation.free();
  return { positions, actions, observations, falls };
}

process.stdout.write(JSON.stringify(episodes.map(path)));
