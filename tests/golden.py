"""Golden numbers: the compiled models and a short walk of each robot.

`python tests/golden.py` prints how the present numbers differ from the stored ones;
`python tests/golden.py --accept` prints the same and then stores them. A difference is a change of
dynamics, reward or observation: it belongs into the changelog.
"""

import pathlib
import sys

import mujoco
import numpy as np

import arc_suite
from arc_suite import models
from arc_suite.cpg import Demonstrator
from arc_suite.robots import ROBOTS

FOLDER = pathlib.Path(__file__).parent / "golden"
STEPS = 30
# Fields of MjModel that decide the dynamics; exact.
PREFIXES = ("body_mass", "body_inertia", "body_ipos", "body_iquat", "body_pos", "body_quat", "body_parentid")
PREFIXES += ("jnt_", "dof_armature", "dof_damping", "geom_", "actuator_gear", "actuator_ctrl", "qpos0")
VISUALS = ("geom_rgba", "geom_group", "geom_matid")


def compiled(model) -> dict[str, np.ndarray]:
    """The arrays of a compiled model that decide its dynamics."""
    arrays = {name: getattr(model, name) for name in dir(model) if name.startswith(PREFIXES) and name not in VISUALS}
    arrays = {f"model/{name}": np.array(array) for name, array in arrays.items() if isinstance(array, np.ndarray)}
    options = ("timestep", "integrator", "solver", "cone", "iterations", "disableflags", "gravity")
    return arrays | {f"option/{name}": np.array(getattr(model.opt, name)) for name in options}


def walked(robot: str, steps: int = STEPS) -> dict[str, np.ndarray]:
    """Observations, rewards and terms of a short walk, partly by rote, partly at random."""
    environment = arc_suite.load(robot, "walk", {"random": 7})
    demonstrator, noise = Demonstrator(robot, "medium"), np.random.RandomState(8)
    timestep = environment.reset()
    observations, rewards, terms = [], [], []
    for _ in range(steps):
        observations.append(np.concatenate(list(timestep.observation.values())))
        timestep = environment.step(demonstrator(timestep) + noise.normal(0.0, 0.3, environment.action_spec().shape))
        rewards.append(timestep.reward)
        terms.append(list(environment.task.terms.values()))
    named = zip(environment.task.terms, *terms, strict=True)
    names = {f"walk/terms/{name}": np.array(values) for name, *values in named}
    return {"walk/observations": np.array(observations), "walk/rewards": np.array(rewards)} | names


def present(robot: str) -> dict[str, np.ndarray]:
    """All golden numbers of a robot, as they are now."""
    written = mujoco.MjModel.from_xml_string(models.assemble(ROBOTS[robot]).to_xml_string())
    return compiled(written) | walked(robot)


def stored(robot: str) -> dict[str, np.ndarray]:
    """All golden numbers of a robot, as they were accepted."""
    with np.load(FOLDER / f"{robot}.npz", allow_pickle=False) as file:
        return dict(file)


def main() -> None:
    """Print every difference, and store the present numbers if asked to; with differences the exit code is 1."""
    is_equal = True
    for robot in ROBOTS:
        now, path = present(robot), FOLDER / f"{robot}.npz"
        before = stored(robot) if path.exists() else {}
        for name in sorted(now.keys() | before.keys()):
            difference = ""
            if name not in now or name not in before:
                difference = "gone" if name in before else "new"
            elif now[name].shape != before[name].shape:
                difference = f"shape {before[name].shape} -> {now[name].shape}"
            elif not np.array_equal(now[name], before[name]):
                difference = f"differs by up to {np.abs(now[name] - before[name]).max():.3g}"
            if difference:
                is_equal = False
                print(f"{robot} {name}: {difference}")
        if "--accept" in sys.argv[1:]:
            np.savez_compressed(path, **now)
    if not is_equal and "--accept" not in sys.argv[1:]:
        sys.exit(1)


if __name__ == "__main__":
    main()
