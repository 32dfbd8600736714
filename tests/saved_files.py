"""Files of every kind that the suite saves, as an earlier version wrote them, in `tests/saved`.

`tests/house/test_saved_files.py` and `tests/learning/agents/test_saved_runs.py` load them, so a change of the code
cannot make a user's files unreadable unnoticed.

`python tests/saved_files.py` writes the files that are missing; with JAX it writes runs, too. A file is replaced by a
new version only on purpose: when its kind was changed and the former kind is refused. Delete it first.
"""

import contextlib
import functools
import importlib.util
import lzma
import os
import pathlib
import pickle
import shutil
import subprocess
import sys
import tempfile

import gymnasium
import numpy as np
from tqdm import tqdm

from arc_suite import data, registry
from arc_suite.animation.studio import states
from arc_suite.animation.studio.sketch import Sketch
from arc_suite.envs.setup import Setup
from arc_suite.robots.spec_files import save_body

FOLDER = pathlib.Path(__file__).parent / "saved"
RUNS = FOLDER / "runs"
SHORT = {"time_limit": 2.0}  # s: episodes of 40 steps
SETTINGS = SHORT | {"kicks": 1.5, "mass": (0.8, 1.2), "delay": (0, 2), "history": 2}
DATASET = data.DatasetSettings(Setup.of("tick", "walk", SHORT), "cpg", ("medium",))
DATASET_ID = DATASET.dataset_id()
NUM_ENVS = 2
BODIES = ("queen", "varied:7")
STEPS_BEFORE = 10  # of environments, before they are saved
STEPS_AFTER = 5  # compared with what they did when they were saved

silent = functools.partial(tqdm, disable=True)

# Runs of the learners: hyperparameters that make them tiny, and the steps between evaluations.
_SMALL = {"hidden": 4, "batch": 8}
_OFF_POLICY = _SMALL | {"start_steps": 20, "buffer_size": 80}
_PHASES = {"phase_every": 40, "phase_updates": 10, "check_every": 5, "patience": 10}
_PARALLEL = {"num_envs": 4, "utd_ratio": 0.25}
_ON_POLICY = {"hidden": 4, "num_envs": 4, "horizon": 10, "epochs": 1, "minibatch": 40}
_DAGGER = _SMALL | {"num_envs": 2, "round": 40, "updates": 10, "last_updates": 10}
HYPERPARAMETERS = {
    "sac": _OFF_POLICY,
    "droq": _OFF_POLICY,
    "speq": _OFF_POLICY | _PHASES,
    "sope_eo": _OFF_POLICY | _PHASES,
    "sacfd": _OFF_POLICY,
    "speq_o2o": _OFF_POLICY | _PHASES,
    "sope": _OFF_POLICY | _PHASES,
    "sac_parallel": _OFF_POLICY | _PARALLEL,
    "xqc": _OFF_POLICY | _PARALLEL,
    "ppo": _ON_POLICY,
    "dagger": _DAGGER,
    "finetune": _ON_POLICY | {"start": "runs/dagger"},
    "dagger_bodies": _DAGGER,
    "finetune_bodies": _ON_POLICY | {"start": "runs/dagger_bodies"},
    "bc": _SMALL,
}
_NEEDS_PRIOR = ("sacfd", "speq_o2o", "sope", "bc")
EVALUATE_EVERY = 40  # steps


def vector(task: str):
    """Return a vector environment of Tick."""
    return gymnasium.make_vec(f"arc_suite/tick-{task}-v0", NUM_ENVS, "vector_entry_point", task_kwargs=SETTINGS)


def bodies_environment(task: str):
    """Return an environment of different bodies."""
    options = {"bodies": list(BODIES), "task_kwargs": SETTINGS | {"history": 0}}
    return gymnasium.make_vec(f"arc_suite/bodies-{task}-v0", NUM_ENVS, "vector_entry_point", **options)


ENVIRONMENTS = {
    "walk": functools.partial(vector, "walk"),
    "directed": functools.partial(vector, "directed"),
    "roam": functools.partial(vector, "roam"),
    "bodies": functools.partial(bodies_environment, "steer"),
}


def actions(environment, seed: int, steps: int) -> list[np.ndarray]:
    """Return random actions of a vector environment."""
    random = np.random.default_rng(seed)
    shape = environment.action_space.shape
    return [random.uniform(-0.3, 0.3, shape).astype(np.float32) for _ in range(steps)]


def rewards(environment) -> np.ndarray:
    """Return the rewards (steps, environments) of the next steps of an environment, with given actions."""
    return np.array([environment.step(action)[1] for action in actions(environment, 1, STEPS_AFTER)])


def started(environment):
    """Return an environment after its first steps."""
    environment.reset(seed=3)
    for action in actions(environment, 0, STEPS_BEFORE):
        environment.step(action)
    return environment


@contextlib.contextmanager
def datasets_in(folder: pathlib.Path):
    """Let datasets lie in a folder."""
    before = os.environ.get("MINARI_DATASETS_PATH")
    os.environ["MINARI_DATASETS_PATH"] = str(folder)
    try:
        yield
    finally:
        os.environ.pop("MINARI_DATASETS_PATH")
        if before is not None:
            os.environ["MINARI_DATASETS_PATH"] = before


PICKLED = ("walk", "directed", "bodies")  # without ground, whose heights take a megabyte


def write_pickled(path: pathlib.Path, value) -> None:
    """Write the pickle of a value, compressed."""
    path.write_bytes(lzma.compress(pickle.dumps(value)))


def read_pickled(name: str):
    """Return the value of a pickle of `tests/saved`."""
    return pickle.loads(lzma.decompress((FOLDER / name).read_bytes()))


def unpack(name: str, folder: pathlib.Path) -> pathlib.Path:
    """Return the folder into which an archive of `tests/saved` was unpacked."""
    shutil.unpack_archive(FOLDER / f"{name}.zip", folder / name)
    return folder / name


def _pack(name: str, folder: pathlib.Path) -> None:
    shutil.make_archive(str(FOLDER / name), "zip", folder)


def _run_program(*arguments) -> None:
    subprocess.run([sys.executable, "-m", "arc_suite", *map(str, arguments)], check=True)


def write_body(path: pathlib.Path) -> None:
    """Write the spec file of a generated body."""
    save_body(registry.body_of("varied:7"), path)


def write_studio_state(path: pathlib.Path) -> None:
    """Write what the widgets of the studio say, as the page saves it."""
    sketch = Sketch(legs=6, length=1.2, lengths=(("lower", 1.1),), task="steer", gait="tripod", kicks=0.5, palette="7")
    command = states.VisitorCommand(forward=0.5, turn=-0.2, height=-0.1)
    path.write_text(states.to_json(states.PageState(sketch, command)), encoding="utf-8")


def write_tracks(path: pathlib.Path) -> None:
    """Write the tracks of two episodes, of which a style is measured."""
    _run_program("style", "--robot", "tick", "--set", "time_limit=2.0", "--episodes", 2, "--save", path)


def write_design(path: pathlib.Path) -> None:
    """Write the folder of a search for bodies, as an archive."""
    with tempfile.TemporaryDirectory() as folder:
        _run_program(*design_command(folder, bodies=20))
        (pathlib.Path(folder) / "gallery.png").unlink()  # which nothing reads
        _pack("design", pathlib.Path(folder))


def design_command(folder, bodies: int) -> list:
    """Return the command of a search for bodies."""
    sizes = ["--bodies", bodies, "--random", 20, "--steps", 50, "--processes", 1]
    return ["design", "--around", "tick", *sizes, "--nopages", "--output", folder]


def write_dataset(path: pathlib.Path) -> None:
    """Write a folder of datasets with one in it, as an archive."""
    with tempfile.TemporaryDirectory() as folder, datasets_in(pathlib.Path(folder)):
        data.collect(DATASET_ID, DATASET, 2, num_envs=1, threads=1, progress=silent)
        _pack("datasets", pathlib.Path(folder))


def write_snapshot(kind: str, path: pathlib.Path) -> None:
    """Write the snapshot of an environment, and the rewards of its next steps."""
    environment = started(ENVIRONMENTS[kind]())
    arrays = dict(environment.snapshot())
    np.savez_compressed(path, **arrays, **{"expected/rewards": rewards(environment)})


def write_pickle(kind: str, path: pathlib.Path) -> None:
    """Write the pickle of an environment, and the rewards of its next steps."""
    environment = started(ENVIRONMENTS[kind]())
    pickled = pickle.dumps(environment)
    write_pickled(path, (pickled, rewards(environment)))


def write_values(path: pathlib.Path) -> None:
    """Write the pickle of values that users keep: setups, a body, a single environment."""
    setup = Setup.of("varied:7", "roam", SETTINGS)
    several = Setup.of("varied:0-7", "steer")
    environment = gymnasium.make("arc_suite/queen-steer-v0")
    write_pickled(path, (setup, several, registry.body_of("spider"), environment))


def write_run(algorithm: str, path: pathlib.Path) -> None:
    """Write the folder of a run that was stopped after its first evaluation, as an archive."""
    from arc_suite.learning.agents.training import train

    with (
        tempfile.TemporaryDirectory() as folder,
        contextlib.chdir(folder),
        datasets_in(pathlib.Path(folder) / "datasets"),
    ):
        configuration = configuration_of_run(algorithm, pathlib.Path(folder))
        train(configuration, pathlib.Path(folder) / algorithm, progress=silent, stop=lambda: True)
        _pack(f"runs/{algorithm}", pathlib.Path(folder) / algorithm)


def configuration_of_run(algorithm: str, folder: pathlib.Path):
    """Return the configuration of a tiny run, and unpack what it begins with into the current folder.

    The path of the run that it starts from is a part of the configuration, and relative to the current folder.
    """
    from arc_suite.learning.agents.configuration import Configuration

    if algorithm in _NEEDS_PRIOR:
        shutil.unpack_archive(FOLDER / "datasets.zip", folder / "datasets")
    hyperparameters = dict(HYPERPARAMETERS[algorithm])
    if "start" in hyperparameters:
        unpack(hyperparameters["start"], folder)
    domain = "varied:0-1" if algorithm.endswith("bodies") else "tick"
    options = {"steps": 3 * EVALUATE_EVERY, "evaluate_every": EVALUATE_EVERY}
    prior = DATASET_ID if algorithm in _NEEDS_PRIOR else None
    return Configuration.of(Setup.of(domain, "walk", SHORT), algorithm, hyperparameters, prior=prior, **options)


WRITERS = {
    "body.json": write_body,
    "studio_state.json": write_studio_state,
    "tracks.npz": write_tracks,
    "design.zip": write_design,
    "datasets.zip": write_dataset,
    "values.pickle.xz": write_values,
}
WRITERS |= {f"snapshot_{kind}.npz": functools.partial(write_snapshot, kind) for kind in ENVIRONMENTS}
WRITERS |= {f"environment_{kind}.pickle.xz": functools.partial(write_pickle, kind) for kind in PICKLED}
if importlib.util.find_spec("jax") is not None:
    WRITERS |= {f"runs/{name}.zip": functools.partial(write_run, name) for name in HYPERPARAMETERS}


def main() -> None:
    """Write the files that are missing."""
    RUNS.mkdir(parents=True, exist_ok=True)
    for name, write in WRITERS.items():
        path = FOLDER / name
        if not path.exists():
            write(path)
            print(f"{name}: {path.stat().st_size:,} bytes")


if __name__ == "__main__":
    main()
