"""Files that name a module of another package: reading them imports nothing, and one line says what is missing."""

import hashlib
import json
import sys

import networks
import numpy as np
import programs
import pytest

import arc_suite
from arc_suite import policies, registry
from arc_suite.cpg import selection
from arc_suite.learning.agents import configuration, run_folder
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.policies import network

# A module whose import leaves a mark, and registers a part of each kind that a run can name.
STROLLING = '''
import pathlib
from typing import NamedTuple
import arc_suite
from arc_suite.arenas import FLAT
from arc_suite.cpg.law import Clocked
from arc_suite.learning.agents.algorithms import ALGORITHMS
from arc_suite.robots import ROBOTS
from arc_suite.tasks.modifiers import Modifier
from arc_suite.tasks.walk import Walk

pathlib.Path(__file__).with_name("imported").touch()

class Preset(NamedTuple):
    """Parameters of a law."""

class Law(Clocked):
    """A law that rests."""
    preset = Preset()
    def __init__(self, task, preset):
        super().__init__(lambda steps, quaternion, angles, velocities: 0.0 * angles)

class Stroll(Walk):
    """The task walk."""
    name = "stroll"

class Fields(NamedTuple):
    """Fields of a modifier."""
    wind: float

class Wind(Fields, Modifier):
    """A modifier that changes nothing."""
    defaults = {"wind": 0.0}
    @classmethod
    def of(cls, settings, body, blocks):
        return cls(settings["wind"])

arc_suite.register(
    module=__name__,
    modifiers=(Wind,),
    body=ROBOTS["tick"].replace(name="beetle"),
    tasks=(Stroll,),
    arenas={"lawn": lambda body: FLAT},
    families={"crab": lambda seed: ROBOTS["tick"].replace(name=f"crab_{seed}")},
    laws={"rest": Law},
    networks={"deep": "no_such_module:Deep.of"},
    algorithms={"search": ALGORITHMS["ppo"]},
)
'''
# Fields of a configuration that name the module.
NAMES = {
    "robot": {"robot": "strolling:beetle"},
    "family": {"robot": "strolling:crab:3"},
    "robots": {"robot": "queen,strolling:crab:0-3", "algorithm": "dagger"},
    "task": {"task": "strolling:stroll"},
    "arena": {"task_kwargs": {"arena": "strolling:lawn"}},
    "arena in training": {"training": {"arena": "strolling:lawn"}},
    "modifier": {"task_kwargs": {"strolling:wind": 1.0}},
    "modifier in training": {"training": {"strolling:wind": 1.0}},
    "algorithm": {"algorithm": "strolling:search"},
    "network": {"hyperparameters": {"network": "strolling:deep"}},
    "preset": {"algorithm": "dagger", "hyperparameters": {"preset": "strolling:rest"}},
}
LINE = "files import nothing; import 'strolling' first"
IN_A_POLICY = {name: NAMES[name] for name in ("robot", "family", "robots", "task", "arena", "modifier")}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Write the module where it can be imported, and return its folder."""
    (tmp_path / "strolling.py").write_text(STROLLING)
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


@pytest.fixture
def without_additions(monkeypatch):
    """Take back what the import of the module registers."""
    tables = (*registry.ADDITIONS.values(), registry.MODULE_OF_NAME, registry.ROBOTS, registry.TASKS, registry.ARENAS)
    tables += (registry.FAMILIES, registry.MODIFIERS, selection.LAWS)
    before = [dict(table) for table in tables]
    yield
    for table, entries in zip(tables, before, strict=True):
        table.clear()
        table.update(entries)
    sys.modules.pop("strolling", None)


@pytest.mark.parametrize("change", NAMES.values(), ids=NAMES)
def test_a_configuration_imports_nothing(folder, change):
    path = folder / "run.json"
    path.write_text(json.dumps({"robot": "tick"} | change))
    with pytest.raises(registry.NotImported, match=rf"^{path}: \w+ 'strolling:\w+': {LINE}$"):
        configuration.read(path)
    assert not (folder / "imported").exists()


def test_a_configuration_takes_names_of_imported_modules(folder, without_additions):
    import strolling  # noqa: F401

    for name, change in NAMES.items():
        run = Configuration.from_dict({"robot": "tick"} | change)
        again = Configuration.from_dict(json.loads(json.dumps(run.to_dict())))
        # One body of a family is written down whole.
        assert again == run and run.modules == (() if name == "family" else ("strolling",))


def test_a_configuration_names_modules_as_other_processes_need_them(folder, without_additions):
    import strolling  # noqa: F401

    run = Configuration.of(arc_suite.Setup.of("beetle", "stroll"), "search", {"network": "deep"})
    assert run.algorithm == "strolling:search" and run.hyperparameters.network == "strolling:deep"
    assert run.name == "beetle-stroll-strolling.search-0"
    assert "--hp=network=strolling:deep" in run.command and "--algorithm=strolling:search" in run.command
    assert Configuration.of(arc_suite.Setup.of("tick"), "dagger", {"preset": "rest"}).modules == ("strolling",)
    assert Configuration.of(arc_suite.Setup.of("tick")).modules == ()


def save_policy(folder, change):
    """Write a policy file with other fields of its setup."""
    network.save(folder / "policy.npz", networks.made())
    with np.load(folder / "policy.npz") as stored:
        arrays = dict(stored)
    described = {name: value for name, value in change.items() if name != "algorithm"}
    arrays["policy"] = np.array(json.dumps(json.loads(str(arrays["policy"])) | described))
    np.savez(folder / "policy.npz", **arrays)


def test_a_record_holds_version_and_hash_of_modules(folder, without_additions):
    """Of those that register its parts, installed or not; a folder of before has none, and is the same run."""
    import strolling  # noqa: F401

    run = Configuration.of(arc_suite.Setup.of("beetle", "stroll"), "search")
    sha256 = hashlib.sha256((folder / "strolling.py").read_bytes()).hexdigest()
    record = run.record()
    assert record["versions"]["module strolling"] == f"sha256 {sha256}"
    metadata = folder / "strolling_kit-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: strolling-kit\nVersion: 1.0\n")
    (metadata / "top_level.txt").write_text("strolling\n")
    assert run.record()["versions"]["module strolling"] == f"strolling-kit 1.0, sha256 {sha256}"
    assert not [name for name in Configuration.of(arc_suite.Setup.of("tick")).record()["versions"] if " " in name]

    others = {name: version for name, version in record["versions"].items() if " " not in name}
    (folder / "config.json").write_text(json.dumps(record | {"versions": others}))
    run_folder.check_same_run(folder, record)
    others["module strolling"] = "sha256 0"
    (folder / "config.json").write_text(json.dumps(record | {"versions": others}))
    with pytest.raises(ValueError, match=r": of another run, with versions.module strolling 'sha256 0', not 'sha256 "):
        run_folder.check_same_run(folder, record)


@pytest.mark.parametrize("change", IN_A_POLICY.values(), ids=IN_A_POLICY)
def test_a_policy_imports_nothing(folder, change):
    save_policy(folder, change)
    for read in (policies.setup_of, policies.load_network, policies.training_seeds):
        with pytest.raises(ValueError, match=rf"^policy .*policy\.npz: \w+ 'strolling:\w+': {LINE}$"):
            read(str(folder / "policy.npz"))
    assert not (folder / "imported").exists()


def test_train_names_modules_for_a_configuration(folder):
    (folder / "run.json").write_text('{"robot": "tick", "algorithm": "strolling:search", "steps": 0}')
    line = "run.json: algorithm 'strolling:search': files import nothing; import 'strolling' first, by --modules\n"
    programs.refused(programs.arc_suite("train", "--config=run.json", cwd=folder), f"arc-suite train: {line}")
    assert not (folder / "imported").exists()
    done = programs.arc_suite("train", "--config=run.json", "--modules=strolling", cwd=folder)
    programs.refused(done, "arc-suite train: run.json: steps: expected an integer from 1, got 0\n")
    done = programs.arc_suite("train", "--modules=stroling", cwd=folder)
    line = "arc-suite train: --modules: cannot import stroling: No module named 'stroling'; did you mean 'strolling'?\n"
    programs.refused(done, line)


BEETLE = {"robot": "strolling:beetle", "task": "strolling:stroll"}


@pytest.mark.parametrize(
    ("program", "arguments", "by"),
    [
        ("evaluate", ["--policy=policy.npz"], "--robot, --task or --set"),
        ("export", ["policy.npz"], "--robot, --task or --set"),
        ("transfer", ["--policy=policy.npz"], "--task or --set"),
        ("play", ["--policy=policy.npz", "--output=a.html"], "--modules"),
    ],
)
def test_programs_say_which_flag_imports(folder, program, arguments, by):
    save_policy(folder, BEETLE)
    line = f"robot 'strolling:beetle': {LINE}, by {by}\n"
    programs.refused(
        programs.arc_suite(program, *arguments, cwd=folder), f"arc-suite {program}: policy policy.npz: {line}"
    )
    assert not (folder / "imported").exists()


@pytest.mark.parametrize(
    ("program", "arguments", "line"),
    [
        (
            "export",
            ["policy.npz", "--robot=strolling:beetle", "--task=strolling:stroll", "--set=target_velocity=0.4"],
            "trained on beetle, stroll, which an export keeps; got flags of beetle, stroll, ",
        ),
        (
            "transfer",
            ["--policy=policy.npz", "--task=strolling:stroll", "--set=strolling:wind=1.0"],
            "expected one of ",
        ),
        ("play", ["--policy=policy.npz", "--modules=strolling", "--robot=queen", "--output=a.html"], "made for beetle"),
    ],
)
def test_flags_are_imported_before_a_policy_is_read(folder, program, arguments, line):
    """The file is read then: the line is about what it holds."""
    save_policy(folder, BEETLE | {"robot": "tick"} if program == "transfer" else BEETLE)
    programs.refused(
        programs.arc_suite(program, *arguments, cwd=folder), f"arc-suite {program}: policy policy.npz: {line}"
    )
    assert (folder / "imported").exists()
