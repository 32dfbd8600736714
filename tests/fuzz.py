"""Damages files and reads them: robots, specs, policies, runs, studies, datasets, ...; `make check-fuzz`, minutes.

`python tests/fuzz.py` prints, for each kind of file, how many damaged ones were read all the same,
refused in one line, ended in a traceback, crashed, or took too long or too much memory. First comes the
table of damages of the kind, `tests/fixtures/damages.py`, then damage at random. Each file is read in a process
of its own that ends after some seconds, as HDF5 itself may loop for ever over one changed byte. Exit
status 1 if anything but that happened. The same seed damages the same places. Linux and macOS only.
"""

import argparse
import contextlib
import functools
import itertools
import json
import os
import pathlib
import resource
import shutil
import signal
import sys
import tempfile
import traceback
import warnings
import zipfile
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from absl import logging
from dm_control.rl.control import PhysicsError
from tqdm import tqdm

import arc_suite
from arc_suite import archives, data, evaluation, motions, policies, registry, style
from arc_suite.animation.clips.creatures import glb
from arc_suite.animation.design.axes import Map
from arc_suite.animation.design.genes import Budget, ProportionGenes
from arc_suite.animation.design.search import Candidates, Search
from arc_suite.animation.design.trials import Trial, evaluate
from arc_suite.envs.setup import Setup
from arc_suite.importing import import_robot
from arc_suite.journal import Journal
from arc_suite.learning.agents import configuration, run_folder
from arc_suite.learning.agents.training import train
from arc_suite.learning.studies import benchmark, publication, results, tables
from arc_suite.motions import reading
from arc_suite.policies import network, zips
from arc_suite.robots.spec_files import EXAMPLES, body_to_json, load_body

ROOT = pathlib.Path(__file__).parents[1]
sys.path.append(str(ROOT / "tests" / "fixtures"))

import damages  # noqa: E402
import drawn_motions  # noqa: E402
import gltf_editor  # noqa: E402
import tiny_studies  # noqa: E402, F401  # registers the learner of the runs: a file that names it imports nothing

LIMIT = 10.0  # s of a processor; the slowest sound file takes a tenth of one
WAIT = 6.0  # times the limit, on the clock: other work may hold the processors, and a pipe may block
MAX_MEMORY = 2 << 30  # bytes
ID = "arc_suite/test/fuzz-v0"
SETTINGS = data.DatasetSettings(Setup.of("tick"), "random", (), steps=5)
QUIET = functools.partial(tqdm, disable=True)
SPEC = EXAMPLES["spider"]

OUTCOMES = ("read", "refused", "traceback", "crashed", "too long", "too large")
READ, REFUSED, TRACEBACK, CRASHED, TOO_LONG, TOO_LARGE = OUTCOMES
_ODD = (None, True, -1, 0, 1e308, -0.0, 2**70, float("nan"), "", "queen", "x" * 10_000, [], {}, [[]], {"": {}})


class Kind(NamedTuple):
    """Files of one kind.

    Attributes:
        file: a sound one, relative to a folder in which `make` has left it.
        make: leaves it in the working folder.
        uses: all that reads what is in the working folder.
        may_loop: whether a library that reads it is known to loop.
        table: kinds of damage by name, functions from the sound file to a damaged one.
    """

    file: str
    make: Callable[[], object]
    uses: tuple[Callable[[], object], ...]
    may_loop: bool = False
    table: Mapping[str, Callable[[bytes], bytes]] = {}


def _copy_robot(name: str, extension: str) -> None:
    """Leave a robot's file, and what names of files in damaged ones may stand for: pipes, and a folder."""
    shutil.copy(ROOT / "tests" / "fixtures" / "robots" / name, f"robot{extension}")
    pathlib.Path("folder.stl").mkdir(exist_ok=True)
    for pipe in damages.PIPES:
        if not os.path.exists(pipe):
            os.mkfifo(pipe)


def _make_meshes() -> None:
    """Leave a robot whose torso collides by a mesh of each format."""
    _copy_robot("go2_like.xml", ".xml")
    names = damages.write_meshes(pathlib.Path())
    put_meshes = damages.with_colliders(names)
    robot = pathlib.Path("robot.xml")
    robot.write_bytes(put_meshes(robot.read_bytes()))


def _make_imported_body() -> None:
    _copy_robot("go2_like.xml", ".xml")
    pathlib.Path("imported.json").write_text(body_to_json(import_robot("robot.xml").body))


def _import_mjcf() -> None:
    import_robot("robot.xml")


def _import_urdf() -> None:
    import_robot("robot.urdf")


def _read_imported_body() -> None:
    environment = arc_suite.load("imported.json", "walk", {"random": 0})
    environment.reset()
    environment.step(np.zeros(environment.action_spec().shape))


def _make_snapshot() -> None:
    np.savez("snapshot.npz", **_open_environment().snapshot())


def _restore() -> None:
    _open_environment().restore(archives.read("snapshot.npz", 1 << 28))


def _open_environment():
    environment = arc_suite.load("tick", "steer", {"random": 0})
    environment.reset()
    return environment


def _make_zip() -> None:
    """Leave the member of a zip of stable-baselines3 that is JSON."""
    pathlib.Path("data.json").write_text(
        json.dumps({"observation_space": {"arc_suite": Setup.of("tick").to_dict()}, "_last_obs": None})
    )


def _read_zip() -> None:
    with zipfile.ZipFile("policy.zip", "w") as archive:
        archive.write("data.json", "data")
    zips.setup(pathlib.Path("policy.zip"))
    zips.statistics(pathlib.Path("policy.zip"))


def _make_tracks() -> None:
    environment, policy = arc_suite.load("tick", "walk"), policies.policy("cpg", "tick")
    style.save("tracks.npz", [style.record(environment, policy, seed=1, max_steps=5)])


def _collect() -> None:
    data.collect(ID, SETTINGS, episodes=2, progress=QUIET)


def _read_spec() -> None:
    arc_suite.load("spec.json", "walk", {"random": 0}).reset()
    load_body("spec.json")


def _continue() -> None:
    shutil.rmtree("copy", ignore_errors=True)
    shutil.copytree("datasets", "copy")
    os.environ["MINARI_DATASETS_PATH"] = os.path.abspath("copy")
    data.collect(ID, SETTINGS, episodes=3, progress=QUIET)


_USES = (lambda: list(data.open(ID)), lambda: data.verify(ID, progress=QUIET), _continue)


def _make_policy() -> None:
    """Leave a policy, and its header as a file of its own: an archive notices most damage by itself."""
    shutil.copy(network.PACKAGED / "tick-walk.npz", "policy.npz")
    with np.load("policy.npz") as arrays:
        pathlib.Path("header.json").write_text(str(arrays["policy"]))


def _act() -> None:
    policy = policies.policy("./policy.npz", "tick")
    evaluation.run(arc_suite.load("tick", "walk", {"time_limit": 0.2}), policy, 0)


def _act_by_header() -> None:
    with np.load("policy.npz") as arrays:
        np.savez("policy.npz", **{**arrays, "policy": np.array(pathlib.Path("header.json").read_text("latin-1"))})
    _act()


def _search() -> None:
    with contextlib.closing(Journal("journal.jsonl", {"seed": 0, "task": "walk"}, Generation)) as journal:
        journal.append(Generation(1.5, (0.25, -0.5)))


class Generation(NamedTuple):
    """Of a search that is none."""

    reward: float
    result: tuple[float, ...]


def _design() -> None:
    """Begin or resume a search for creatures."""
    trial = Trial.of("walk", {}, "speed", Budget(mass=12.0, span=1.5), 10)
    search = Search(ProportionGenes(), Map.of(("legs", "links"), None, 0.1), trial, 0, "design")
    with contextlib.closing(Journal("bodies.jsonl", {"goal": "speed"}, Candidates.from_json)) as journal:
        for batch in journal.generations:
            search.add(batch)
        if not journal.generations:
            journal.append(search.evaluate_batch(lambda jobs: list(itertools.starmap(evaluate, jobs))))


def _run() -> tables.Run:
    return tables.run("tick", "tiny_studies:climb", 40, task_kwargs={"time_limit": 0.2}, evaluate_every=20)


def _begin_run() -> None:
    train(_run().configuration, pathlib.Path("runs", RUN), progress=QUIET, stop=lambda: True)
    publication.publish([_run()], pathlib.Path("runs"), pathlib.Path("published"))


def _finish_run() -> None:
    train(_run().configuration, pathlib.Path("runs", RUN), progress=QUIET)
    publication.publish([_run()], pathlib.Path("runs"), pathlib.Path("published"))


def _make_motions() -> None:
    """Leave a motion as files of all kinds; of the .glb, its JSON and its buffer, too."""
    body = registry.body_of("tick")
    motion = drawn_motions.raise_leg(body, 0)
    motions.save(motion, "motion.npz")
    content = glb(body, [drawn_motions.clip_of(body, motion)], "nodes", "moving")
    pathlib.Path("motion.glb").write_bytes(content)
    editor = gltf_editor.Editor(content)
    pathlib.Path("motion.json").write_text(json.dumps(editor.json))
    pathlib.Path("motion.bin").write_bytes(editor.buffer)
    pathlib.Path("motion.bvh").write_text(drawn_motions.to_bvh(body, motion))
    pathlib.Path("motion.csv").write_text(drawn_motions.to_csv(body, motion))


def _read_motion(path: str) -> None:
    fps = 30.0 if path.endswith(".csv") else None  # all other files say it
    motion, _ = reading.read(path, registry.body_of("tick"), reading.Options(fps=fps))
    motions.resample(motion, 50.0)


def _read_json_of_motion() -> None:
    editor = gltf_editor.Editor(pathlib.Path("motion.glb").read_bytes())
    content = pathlib.Path("motion.json").read_bytes()
    pathlib.Path("assembled.glb").write_bytes(gltf_editor.assemble(content, editor.buffer))
    _read_motion("assembled.glb")


def _copied_runs() -> pathlib.Path:
    shutil.rmtree("copy", ignore_errors=True)
    return pathlib.Path(shutil.copytree("runs", "copy"))


def _resume_run() -> None:
    folder = _copied_runs() / RUN
    train(configuration.read(folder / "config.json"), folder, progress=QUIET)


def _publish() -> None:
    publication.publish([_run()], _copied_runs(), pathlib.Path("published"))


def _act_by_run() -> None:
    policies.policy(f"./runs/{RUN}", "tick")


def _read_study() -> None:
    results.read_results(tables.study(STUDY).runs, pathlib.Path("studies", STUDY))
    results.read_demonstrators(pathlib.Path("studies", STUDY))


def _read_scores() -> None:
    benchmark.text(pathlib.Path("studies"))


def _copy_studies() -> None:
    shutil.copytree(ROOT / "studies" / STUDY, f"studies/{STUDY}", dirs_exist_ok=True)
    shutil.copy(ROOT / "studies" / benchmark.SCORES, "studies")


TABLES = (*run_folder.TABLES, "style")  # of a run that has begun
RUN, STUDY = "tick-walk-tiny_studies.climb-0", "samples-sac"
_USES_OF_RUNS = (_resume_run, _publish, _act_by_run)
KINDS = {
    "robot in MJCF": Kind(
        "robot.xml", lambda: _copy_robot("go2_like.xml", ".xml"), (_import_mjcf,), table=damages.MJCF
    ),
    "robot in URDF": Kind(
        "robot.urdf", lambda: _copy_robot("a1_like.urdf", ".urdf"), (_import_urdf,), table=damages.URDF
    ),
    **{
        f"mesh in {name.rpartition('.')[2].upper()}": Kind(name, _make_meshes, (_import_mjcf,), table=damages.MESHES)
        for name in damages.MESH_FILES
    },
    "imported body": Kind("imported.json", _make_imported_body, (_read_imported_body,), table=damages.IMPORTED),
    "spec": Kind("spec.json", lambda: shutil.copy(SPEC, "spec.json"), (_read_spec,), table=damages.JSON),
    "tracks": Kind("tracks.npz", _make_tracks, (lambda: style.load("tracks.npz"),), table=damages.ARCHIVES),
    "motion": Kind("motion.npz", _make_motions, (lambda: _read_motion("motion.npz"),), table=damages.ARCHIVES),
    "motion in glTF": Kind("motion.glb", _make_motions, (lambda: _read_motion("motion.glb"),)),
    "JSON of a motion in glTF": Kind("motion.json", _make_motions, (_read_json_of_motion,), table=damages.JSON),
    "motion in BVH": Kind("motion.bvh", _make_motions, (lambda: _read_motion("motion.bvh"),)),
    "motion in CSV": Kind("motion.csv", _make_motions, (lambda: _read_motion("motion.csv"),), table=damages.CSV),
    "policy": Kind("policy.npz", _make_policy, (_act,), table=damages.ARCHIVES | damages.GRAPHS),
    "header of a policy": Kind("header.json", _make_policy, (_act_by_header,), table=damages.JSON),
    "zip of another library": Kind("data.json", _make_zip, (_read_zip,), table=damages.JSON),
    "snapshot": Kind("snapshot.npz", _make_snapshot, (_restore,), table=damages.ARCHIVES | damages.SNAPSHOTS),
    "journal of a search": Kind("journal.jsonl", _search, (_search,), table=damages.LINES),
    "journal of a design": Kind("bodies.jsonl", _design, (_design,), table=damages.LINES),
    **{
        f"{name} of a run": Kind(
            f"runs/{RUN}/{name}", _begin_run, _USES_OF_RUNS, table=damages.TABLES[pathlib.Path(name).suffix]
        )
        for name in ("config.json", "checkpoint.npz", "policy.npz", *(f"{table}.csv" for table in TABLES))
    },
    "final.csv of a run": Kind(f"runs/{RUN}/final.csv", _finish_run, _USES_OF_RUNS, table=damages.CSV),
    **{
        f"{name} of a study": Kind(f"studies/{STUDY}/{name}", _copy_studies, (_read_study,), table=damages.CSV)
        for name in (results.RUNS, results.EVALUATIONS, results.DEMONSTRATORS)
    },
    "scores of a benchmark": Kind(f"studies/{benchmark.SCORES}", _copy_studies, (_read_scores,), table=damages.CSV),
    "metadata of a dataset": Kind(f"datasets/{ID}/data/metadata.json", _collect, _USES, table=damages.JSON),
    "episodes of a dataset": Kind(
        f"datasets/{ID}/data/main_data.hdf5", _collect, _USES, may_loop=True, table=damages.EPISODES
    ),
}


def damaged(sound: bytes, random: np.random.Generator) -> bytes:
    """Return a file with a few bytes changed, cut out, doubled or put in; of JSON also with an odd value in it."""
    if sound.startswith(b"{") and random.integers(2):
        first, *others = (
            sound.splitlines(keepends=True) if sound.startswith(b'{"') else [sound]
        )  # a line is JSON, or all
        return b"".join([_oddly_valued(first, random), b"\n" * bool(others), *others])
    # Half of the places lie anywhere, half near the beginning, where binary files describe themselves.
    first = int(random.integers(len(sound)) if random.integers(2) else len(sound) ** random.uniform()) % len(sound)
    last = first + int(random.integers(1, 9))
    noise = random.bytes(last - first)
    match random.integers(5):
        case 0:
            return sound[:first]
        case 1:
            return sound[:first] + sound[last:]
        case 2:
            return sound[:last] + sound[first:]
        case 3:
            return sound[:first] + noise + sound[first:]
        case _:
            return sound[:first] + noise + sound[last:]


def _oddly_valued(sound: bytes, random: np.random.Generator) -> bytes:
    tree = json.loads(sound)
    places = list(_places(tree))
    container, key = places[random.integers(len(places))]
    if random.integers(5):
        container[key] = _ODD[random.integers(len(_ODD))]
    else:
        del container[key]
    return json.dumps(tree).encode()


def _places(tree):
    """Yield every container with every key or index in it."""
    for key in range(len(tree)) if isinstance(tree, list) else list(tree):
        yield tree, key
        if isinstance(tree[key], list | dict):
            yield from _places(tree[key])


def outcome(*uses: Callable[[], object], limit: float = LIMIT) -> str:
    """Return the worst that came of using a file, in a process of its own: one of `OUTCOMES`."""
    child = os.fork()
    if not child:
        for kind in (signal.SIGPROF, signal.SIGALRM):
            signal.signal(kind, signal.SIG_DFL)  # ends the process wherever it is, in a library too
        signal.setitimer(signal.ITIMER_PROF, limit)
        signal.setitimer(signal.ITIMER_REAL, WAIT * limit)
        os._exit(OUTCOMES.index(_worst_of(uses)))
    _, wait_status = os.waitpid(child, 0)
    status = os.waitstatus_to_exitcode(wait_status)
    if status < 0:
        return TOO_LONG if status in (-signal.SIGPROF, -signal.SIGALRM) else CRASHED
    return OUTCOMES[status]


def _worst_of(uses: Sequence[Callable[[], object]]) -> str:
    """Return the worst that came of using a file in this process, which started with the memory of its parent."""
    memory_before = _peak_memory()
    worst = max((_tried(use) for use in uses), key=OUTCOMES.index)
    return TOO_LARGE if _peak_memory() - memory_before > MAX_MEMORY else worst


def _peak_memory() -> int:
    """Return the largest memory of this process until now, bytes."""
    unit = 1 if sys.platform == "darwin" else 1024  # bytes
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit


def _tried(use: Callable[[], object]) -> str:
    try:
        use()
    except BaseException as error:
        if (
            isinstance(error, ValueError | OSError | PhysicsError)
            and "\n" not in str(error)
            and 0 < len(str(error)) < 2000
        ):
            return REFUSED
        traceback.print_exc()
        return TRACEBACK
    return READ


def fuzz(kind: Kind, cases: int, seed: int, label: str) -> Counter:
    """Return how often each outcome came of reading a kind of file in the working folder, differently damaged."""
    if outcome(kind.make) != READ or outcome(*kind.uses) != READ:
        raise RuntimeError(f"{label}: cannot make or read a sound file")
    path, outcomes = pathlib.Path(kind.file), Counter()
    sound = path.read_bytes()

    def read(name: str, content: bytes) -> None:
        path.write_bytes(content)
        result = outcome(*kind.uses)
        outcomes[result] += 1
        if result not in (READ, REFUSED):
            print(f"{label}: {result}: {name}", file=sys.stderr)

    for name, damage in kind.table.items():
        read(name, damage(sound))
    for case in tqdm(range(cases), desc=label, unit="file", leave=False, disable=None):
        read(f"--seed {seed}, case {case}", damaged(sound, np.random.default_rng((seed, case))))
    path.write_bytes(sound)
    return outcomes


def main() -> int:
    """Print the table and return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=500, help="damaged files of each kind")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--kind", choices=list(KINDS), help="of files; all by default")
    arguments = parser.parse_args()
    logging.set_verbosity(logging.ERROR)  # MuJoCo's warnings about odd models
    warnings.simplefilter("error", RuntimeWarning)  # users would see it next to the line
    print(f"{'file':<24}" + "".join(f"{name:>11}" for name in OUTCOMES))
    failed = False
    with tempfile.TemporaryDirectory() as folder:
        os.environ["MINARI_DATASETS_PATH"] = os.path.join(folder, "datasets")
        os.chdir(folder)
        for label, kind in KINDS.items():
            if arguments.kind not in (None, label):
                continue
            found = fuzz(kind, arguments.cases, arguments.seed, label)
            failed |= bool(
                found[TRACEBACK] or found[CRASHED] or found[TOO_LARGE] or (found[TOO_LONG] and not kind.may_loop)
            )
            print(f"{label:<24}" + "".join(f"{found[name]:>11}" for name in OUTCOMES), flush=True)
            shutil.rmtree("datasets", ignore_errors=True)
        os.chdir("/")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
