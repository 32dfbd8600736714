"""Datasets made in bad faith: nothing is imported, nothing outside the dataset is read, one line says what is wrong."""

import json
import os
import subprocess
import sys

import h5py
import numpy as np
import programs
import pytest
from datasets import ID, SETTINGS, collect, digests, edited, verify
from tiers import never, tiers

from arc_suite import data, style

READERS = {"open": lambda dataset_id: list(data.open(dataset_id)), "verify": verify}

STROLL = """
import pathlib
import arc_suite
from arc_suite.arenas import FLAT
from arc_suite.tasks.walk import Walk
pathlib.Path(__file__).with_name("imported").touch()
class Stroll(Walk):
    name = "stroll"
arc_suite.register(module=__name__, tasks=(Stroll,), arenas={"lawn": lambda body: FLAT})
"""


def collected(*arguments):
    """Run the program in an interpreter of its own."""
    command = [sys.executable, "-m", "arc_suite", "collect", *arguments]
    return subprocess.run(command, capture_output=True, text=True)


@pytest.fixture
def module(tmp_path, monkeypatch):
    """Write a module that can be imported, and return the file that its import leaves."""
    (tmp_path / "strolling.py").write_text(STROLL)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=os.pathsep)
    return tmp_path / "imported"


def assert_refused(use, *parts):
    with pytest.raises(ValueError) as error:
        use(ID)
    message = str(error.value)
    assert message.startswith(f"dataset {ID!r}") and "\n" not in message and len(message) < 600
    for part in parts:
        assert part in message


def about(root, **changes):
    """Change what the metadata say of the dataset's settings."""
    edited(root, lambda metadata: metadata["arc_suite"].update(changes))


@pytest.mark.slow
@pytest.mark.parametrize(
    "change",
    [{"robot": "strolling:queen"}, {"task": "strolling:walk"}, {"task_kwargs": {"arena": "strolling:flat"}}],
    ids=["robot", "task", "arena"],
)
def test_metadata_import_nothing(kept, module, change):
    about(kept, **change)
    for use in (*READERS.values(), style.source):
        assert_refused(use, "files import nothing; import 'strolling' first")
    done = collected(f"--verify={ID}")
    programs.refused(done, f"arc-suite collect: dataset {ID!r}")
    assert "import 'strolling' first" in done.stderr
    assert not module.exists()


def test_presets_of_a_dataset_import_nothing(kept, module):
    """They say who acted; reading and replaying need no demonstrator."""
    about(kept, presets=["strolling:stroll"])
    for use in READERS.values():
        use(ID)
    assert data.open(ID).settings.presets == ("strolling:stroll",) and not module.exists()


@pytest.mark.long
def test_what_the_caller_names_is_imported(module):
    def verify(*arguments):
        return collected(f"--verify={ID}", *arguments)

    named = ("--task=strolling:stroll", "--set=arena=strolling:lawn")
    programs.passed(collected(f"--id={ID}", "--policy=zero", "--steps=3", "--episodes=1", *named))
    line = "task 'strolling:stroll': files import nothing; import 'strolling' first"
    programs.refused(verify(), f"arc-suite collect: dataset {ID!r}: metadata.json: {line}\n")
    assert programs.passed(verify(*named)) == f"{ID}: 1 episodes replayed, all bit-equal\n"
    line = "holds episodes of the task strolling:stroll, and not of walk"
    done = verify("--set=arena=strolling:lawn", "--task=walk")
    programs.refused(done, f"arc-suite collect: dataset {ID!r} {line}\n")


@pytest.mark.parametrize("value", tiers(["1\n2", "x" * 10_000, ["\n"] * 1000], lambda value: value == "1\n2"))
def test_versions_are_told_in_one_line(kept, value):
    edited(kept, lambda metadata: metadata["arc_suite"]["versions"].update(numpy=value))
    assert_refused(verify, "was collected with numpy ")
    edited(kept, lambda metadata: metadata["arc_suite"]["versions"].update(numpy=np.__version__))
    about(kept, task_version=value)
    assert_refused(verify, "was collected with version ", " of walk; ")


@pytest.mark.slow
@pytest.mark.parametrize(
    "robot", ["/dev/zero", "spider.json", "", "nobody", "{", "{}", "[" * 9999, None, 3, ["queen"], {"name": "queen"}]
)
def test_robots_are_registered_names_and_inline_bodies_alone(kept, robot):
    about(kept, robot=robot)
    assert_refused(data.open, "metadata.json: ")


@pytest.mark.parametrize(
    ("name", "value"),
    tiers(
        [
            *(("seed", value) for value in ("5", 5.0, None, [5], -1, 2**40, True)),
            *(("steps", value) for value in ("20", 0, 1e3, {})),
            *(("noise", value) for value in ("0", -1.0, float("nan"), [])),
            *(("presets", value) for value in ("medium", [1], None)),
            *(("task_kwargs", value) for value in ("walk", [], None, 3)),
            ("policy", 7),
        ],
        never,
        lambda name, value: isinstance(value, str | int),
    ),
)
def test_settings_of_another_type_are_named(kept, name, value):
    about(kept, **{name: value})
    for use in READERS.values():
        assert_refused(use, f"metadata.json: {name}" if name in ("seed", "steps", "noise") else f"expected {name} ")


@pytest.mark.parametrize("value", tiers(["1", -1, 2**70, 1.0, None], lambda value: value == -1))
@pytest.mark.parametrize("name", ["total_episodes", "total_steps"])
def test_counts_of_another_type_are_named(kept, name, value):
    edited(kept, lambda metadata: metadata.update({name: value}))
    assert_refused(data.open, name)


def test_steps_that_no_episode_has_are_not_allocated(kept):
    about(kept, steps=10**15)
    edited(kept, lambda metadata: metadata.pop("env_spec"))
    assert_refused(verify, "20 steps were recorded, 21 replayed")


def altered(root, change):
    with h5py.File(root / ID / "data" / "main_data.hdf5", "a") as file:
        change(file)


def replaced(path, method, *arguments, **settings):
    """Return a change that puts what a method of a group makes in the place of an array or a group."""

    def change(file):
        parent, _, name = path.rpartition("/")
        del file[path]
        getattr(file[parent or "/"], method)(name, *arguments, **settings)

    return change


REWARDS, LINK, HUGE = "episode_0/rewards", "a link to elsewhere", 1 << 40
SOFT, EXTERNAL = h5py.SoftLink("/episode_1"), h5py.ExternalLink("../x.hdf5", "episode_0")
ELSEWHERE = [("/etc/hostname", 0, 160)]
ALTERED = {
    "huge": (replaced(REWARDS, "create_dataset", (HUGE,), "f8"), "claims"),
    "huge in two axes": (replaced(REWARDS, "create_dataset", (HUGE, HUGE >> 20), "f8"), "expected"),
    "huge term": (
        replaced("episode_0/infos/reward_terms/forward", "create_dataset", (HUGE,), "f4"),
        "expected 21 of float64",
    ),
    "chunked": (replaced(REWARDS, "create_dataset", (20,), "f8", chunks=(5,)), "in one piece"),
    "stored elsewhere": (replaced(REWARDS, "create_dataset", (20,), "f8", external=ELSEWHERE), "in one piece"),
    "external link": (replaced(REWARDS, "__setitem__", h5py.ExternalLink("/x", "/y")), LINK),
    "soft link": (replaced(REWARDS, "__setitem__", SOFT), LINK),
    "external episode": (replaced("episode_0", "__setitem__", EXTERNAL), LINK),
    "soft episode": (replaced("episode_0", "__setitem__", SOFT), LINK),
    "group": (replaced(REWARDS, "create_group"), "expected a dataset"),
    "text": (replaced(REWARDS, "create_dataset", data="x"), "expected"),
    "complex": (replaced(REWARDS, "create_dataset", data=np.zeros(20, complex)), "complex128"),
    "no steps": (replaced(REWARDS, "create_dataset", (0,), "f8"), "episode_0: "),
    "other joints": (replaced("episode_0/actions", "create_dataset", data=np.zeros((20, 3), "f4")), "expected"),
    "seed": (lambda file: file["episode_0"].attrs.create("seed", "five"), "attribute seed to be one int"),
    "length": (lambda file: file["episode_0"].attrs.create("length", np.zeros(9)), "attribute length to be one int"),
    "sha256": (lambda file: file["episode_0"].attrs.create("sha256", 3), "attribute sha256 to be one str"),
}


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", tiers(ALTERED, lambda name: name in ("group", "complex", "other joints", "seed"), never)
)
def test_episodes_that_are_stored_otherwise_are_one_line(root, name):
    change, reason = ALTERED[name]
    collect(ID, SETTINGS, 2)
    altered(root, change)
    for use in (*READERS.values(), lambda dataset_id: collect(dataset_id, SETTINGS, 3)):
        assert_refused(use, "main_data.hdf5: ", reason)
    collect(ID, SETTINGS, 2, overwrite=True)
    assert verify(ID) == 2


@pytest.mark.slow
def test_an_array_of_one_place_many_times_is_not_read(kept):

    def change(file):
        group = file["episode_0"]["infos/reward_terms"]
        for number in range(1000):
            group[f"again{number}"] = group["forward"]

    altered(kept, change)
    assert_refused(READERS["open"], "its arrays claim")


@pytest.mark.slow
def test_continuing_compares_what_it_keeps(kept):
    altered(kept, lambda file: file["episode_1/rewards"].__setitem__(3, 7.0))
    assert_refused(lambda dataset_id: collect(dataset_id, SETTINGS, 3), "main_data.hdf5: episode_1: expected ")
    collect(ID, SETTINGS, 3, overwrite=True)
    assert len(digests()) == 3


def test_episodes_of_no_index_are_named(kept):
    altered(kept, lambda file: file.move("episode_0", "episode_00"))
    assert_refused(lambda dataset_id: collect(dataset_id, SETTINGS, 3), "'episode_00': expected the name of an episode")


def test_nothing_outside_is_deleted(root, tmp_path):
    (tmp_path / "home").mkdir()
    (tmp_path / "home" / ".profile").touch()
    (root / ID).mkdir(parents=True)
    (root / ID / "data").symlink_to(tmp_path / "home")
    assert_refused(lambda dataset_id: collect(dataset_id, SETTINGS, 1), "is a link")
    assert (tmp_path / "home" / ".profile").exists()


@pytest.mark.parametrize("name", ["metadata.json", "main_data.hdf5"])
def test_a_pipe_is_not_waited_for(kept, name):
    path = kept / ID / "data" / name
    path.unlink()
    os.mkfifo(path)
    assert_refused(READERS["open"], f"{name}: expected a file")


def test_metadata_of_any_size_are_not_read(kept):
    os.truncate(kept / ID / "data" / "metadata.json", 1 << 40)
    assert_refused(data.open, "metadata.json: expected at most 16777216 bytes")


def test_author_and_code_are_in_the_metadata_where_they_are_said(kept):
    assert not {"author", "code_permalink"} & data.open(ID).metadata.keys()
    collect(ID, SETTINGS, 3, author="A. Walker", code_permalink="file:///walks/1")
    collect(ID, SETTINGS, 4)
    import minari

    metadata = minari.load_dataset(ID).storage.metadata
    assert (metadata["author"], metadata["code_permalink"]) == ({"A. Walker"}, "file:///walks/1")
    before = digests()
    assert collect(ID, SETTINGS, 4, author="B. Walker") == 0  # a complete dataset
    metadata = minari.load_dataset(ID).storage.metadata
    assert (metadata["author"], metadata["code_permalink"]) == ({"B. Walker"}, "file:///walks/1")
    assert metadata["total_episodes"] == 4 and digests() == before


def test_a_spec_of_the_environment_that_contradicts_the_settings_is_refused(kept):
    """Minari's `recover_environment` makes the environment by the spec, and a replay by the settings."""
    spec = json.loads(data.open(ID).metadata["env_spec"])
    for change, line in (
        ({"max_episode_steps": 40}, "max_episode_steps of its env_spec is 40, and its settings say 20"),
        ({"id": "arc_suite/tick-walk-v0"}, 'id of its env_spec is "arc_suite/tick-walk", and its settings say "arc'),
        ({"entry_point": "elsewhere:Env"}, 'entry_point of its env_spec is "elsewhere:Env", and its settings say "a'),
        ({"kwargs": spec["kwargs"] | {"domain_name": "tick"}}, 'kwargs of its env_spec is {"domain_name": "tick", "ta'),
        ({"kwargs": spec["kwargs"] | {"task_kwargs": {"gait": "wave"}}}, "kwargs of its env_spec is "),
    ):
        edited(kept, lambda metadata, change=change: metadata.update(env_spec=json.dumps(spec | change)))
        assert_refused(data.open, "metadata.json: ", line)
        assert_refused(verify, line)
    for damaged in ("{", "[]", "{}", 3, "[" * 9999):
        edited(kept, lambda metadata, damaged=damaged: metadata.update(env_spec=damaged))
        assert_refused(data.open, "metadata.json: ")
    edited(kept, lambda metadata: metadata.update(env_spec=json.dumps(spec | {"id": "arc_suite/queen-walk-v7"})))
    assert len(data.open(ID)) == 2  # of a version that this one does not replay
