"""The model card of a run: what it says, from a run of an algorithm that needs NumPy alone."""

import hashlib
import json
import pathlib
import re
import sys
import types

import imageio.v3 as imageio
import numpy as np
import programs
import pytest
import tiny_studies

import arc_suite
from arc_suite import learning, motions, registry, versions
from arc_suite.evaluation import judging
from arc_suite.learning import cards, finals
from arc_suite.learning.agents import configuration, run_folder
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.motions import striding
from arc_suite.policies import network
from arc_suite.tasks.walk import Walk

SETTINGS = {"time_limit": 0.25}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("runs") / "climber"
    learning.train("tick", algorithm="tiny_studies:climb", task_kwargs=SETTINGS, steps=20, folder=path)
    return path


@pytest.fixture(scope="module")
def run(folder):
    return configuration.read(folder / "config.json")


def test_a_card_says_what_a_hub_and_a_reader_want(run, folder, monkeypatch):
    monkeypatch.setattr(cards, "_draw", lambda run, folder: None)
    assert cards.write(run, folder) == folder / "README.md"
    card = (folder / "README.md").read_text()
    head = card.split("---")[1]
    fields = dict(line.split(": ", 1) for line in head.strip().splitlines())
    assert json.loads(fields["license"]) == "other" and "walk" in json.loads(fields["tags"])
    returns = run_folder.latest_returns(run_folder.table(folder, "evaluations"))
    (result,) = json.loads(fields["model-index"])[0]["results"]
    assert result["metrics"][0]["value"] == pytest.approx(returns.mean(), abs=0.05)
    mean, low, high = map(float, re.search(r"return \| ([\d.]+), 95 % interval \[([\d.]+), ([\d.]+)\]", card).groups())
    assert low <= mean <= high and mean == pytest.approx(returns.mean(), abs=0.05)
    assert "| steps | 20 of 20 |" in card and '| settings | `{"time_limit": 0.25}` |' in card
    assert re.search(r"\| score \| -?\d\.\d\d, 95 % interval \[", card)
    assert (
        f"arc-suite evaluate --policy runs/{folder.name}\n" in card
        and str(folder) not in card
        and f"\n{run.command}\n" in card
    )
    assert re.search(r"policy, sha256 \| `[0-9a-f]{64}`", card) and "| mujoco | 3." in card
    commit = json.loads((folder / "config.json").read_text()).get("commit")
    assert commit == versions.commit_of_clone()
    if commit is not None:
        assert f"| commit of arc_suite | `{commit}` |" in card and f"commit `{commit.removesuffix('-dirty')}`." in card
    assert "\npip install -e '.[animate]'\n" in card and "arc-suite play" not in card  # which needs `make web`
    assert "](picture.png)" not in card  # which was not drawn
    sha256 = hashlib.sha256(pathlib.Path(tiny_studies.__file__).read_bytes()).hexdigest()
    assert f"| module tiny_studies | sha256 {sha256} |" in card


TICK = registry.ROBOTS["tick"]
AGAIN = "arc-suite train --config config.json -o again"


def test_commands_hold_no_text_of_a_file(tmp_path):
    """The motion of a style or of `mimic`, the ground of an arena, and a body are in config.json."""
    walk = tmp_path / "walk.npz"
    motions.save(striding.stride(TICK, 1.5, 0.6, np.array((0.0, 0.5, 0.0, 0.5, 0.0, 0.5)), 0.3), walk)
    hills = tmp_path / "hills.png"
    heights = np.random.default_rng(0).integers(0, 40, size=(128, 128), dtype=np.uint8)
    imageio.imwrite(hills, heights)
    ground = {"arena": f"{hills}:8x8x0.1"}
    of_files = (
        Configuration.of(arc_suite.Setup.of("tick", "steer"), "ppo", {"style": str(walk)}),
        Configuration.of(arc_suite.Setup.of("tick", "mimic", {"motion": str(walk)}), "ppo"),
        Configuration.of(arc_suite.Setup.of("tick", "steer", ground), "ppo"),
        Configuration.of(arc_suite.Setup.of("tick", "steer"), "ppo", training=ground),
        Configuration.of(arc_suite.Setup.of(TICK.replace(name="dachs")), "ppo"),
    )
    assert [cards._training_command(run) for run in of_files] == [AGAIN] * len(of_files)
    by_name = Configuration.of(arc_suite.Setup.of("tick", "mimic", {"motion": "walk"}), "ppo", seed=3)
    assert cards._training_command(by_name) == by_name.command


def test_a_card_names_the_motion_of_a_file(tmp_path):
    walk = tmp_path / "walk.npz"
    motions.save(striding.stride(TICK, 1.5, 0.6, np.array((0.0, 0.5, 0.0, 0.5, 0.0, 0.5)), 0.3), walk)
    settings = {"motion": str(walk), "time_limit": 0.25}
    folder = tmp_path / "run"
    training = {"motion": str(walk)}
    learning.train(
        "tick", "mimic", "tiny_studies:climb", task_kwargs=settings, training=training, steps=20, folder=folder
    )
    card = cards.text(configuration.read(folder / "config.json"), folder)
    assert '| settings | `{"motion": "walk", "time_limit": 0.25}` |' in card and AGAIN in card
    assert '| settings in training alone | `{"motion": "walk"}` |' in card
    assert max(map(len, card.splitlines())) < 1000


@pytest.mark.parametrize(
    ("robot", "of_suite"),
    [
        ("tick", True),
        ("spider", True),
        ("random:7", True),
        ("few_legs:3", True),
        ("varied:0-9", True),
        (TICK.replace(name="dachs"), False),
        (TICK.replace(name="spider"), False),
        (TICK.replace(name="random_7"), False),
        (TICK.replace(name="random_x"), False),
    ],
)
def test_bodies_of_others_have_licenses_of_their_own(robot, of_suite):
    run = types.SimpleNamespace(setup=arc_suite.Setup.of(robot), parts_of_others=())
    assert cards._is_of_suite(run) == of_suite
    assert ("looks are the suite's" in cards._license_text(run)) == of_suite
    assert (f"`{run.setup.name}` is no robot of the suite" in cards._license_text(run)) != of_suite


def test_a_generated_body_of_a_family_of_others_is_none_of_the_suite(carrier):
    run = Configuration.of(arc_suite.Setup.of("outside:swarm:0"), "dagger")
    assert not cards._is_of_suite(run)


OF_AUTHOR = "The license of this policy is for its author to state: set `license` at the head of this card."


@pytest.fixture
def carrier(monkeypatch):
    """Register parts of each kind as if a module `outside` had, and take them back afterwards."""
    before = [dict(table) for table in (registry.ROBOTS, registry.TASKS, registry.FAMILIES, registry.MODULE_OF_NAME)]
    body = registry.ROBOTS["tick"].replace(name="mantis")
    carry = type("Carry", (Walk,), {"name": "carry"})
    arc_suite.register(
        module="outside", body=body, tasks=(carry,), families={"swarm": lambda seed: body.replace(name=f"swarm_{seed}")}
    )
    monkeypatch.setitem(sys.modules, "outside", types.ModuleType("outside"))
    yield
    tables = (registry.ROBOTS, registry.TASKS, registry.FAMILIES, registry.MODULE_OF_NAME)
    for table, entries in zip(tables, before, strict=True):
        table.clear()
        table.update(entries)


@pytest.mark.parametrize(
    ("robot", "task", "algorithm", "line"),
    [
        (
            "mantis",
            "carry",
            "dagger",
            "Not of the suite: the robot `outside:mantis`, the task `outside:carry`. `mantis` is no robot of the "
            f"suite: its license is that of the body's author. {OF_AUTHOR}",
        ),
        (
            "tick",
            "walk",
            "tiny_studies:climb",
            "Not of the suite: the algorithm `tiny_studies:climb`. The creature and its looks are the suite's, under "
            f"Apache-2.0. {OF_AUTHOR}",
        ),
        ("queen,outside:swarm:0-1", "walk", "dagger_bodies", None),
        ("tick", "walk", "dagger", "Apache-2.0, as the suite. The creature and its looks are the suite's."),
        (
            "varied:0-1",
            "walk",
            "dagger_bodies",
            "Apache-2.0, as the suite. The creature and its looks are the suite's.",
        ),
    ],
)
def test_parts_of_others_leave_the_license_to_the_author(carrier, robot, task, algorithm, line):
    run = Configuration.of(arc_suite.Setup.of(robot, task), algorithm)
    text = cards._license_text(run)
    assert text == line if line else text.startswith("Not of the suite: the family `outside:swarm`. ")
    is_of_suite = text.startswith("Apache-2.0")
    assert f'license: "{"apache-2.0" if is_of_suite else "other"}"' in cards._metadata(run, 1.0)


def test_a_card_tells_the_returns_of_its_policy_and_not_of_an_earlier_one(tmp_path, monkeypatch):
    """A run that goes on after its judging has other episodes until the next one."""
    monkeypatch.setattr(cards, "_draw", lambda run, folder: None)
    settings = {"algorithm": "tiny_studies:climb", "task_kwargs": SETTINGS, "folder": tmp_path / "run"}
    policy = learning.train("tick", steps=20, **settings)
    run = configuration.read(tmp_path / "run" / "config.json")
    sha256 = network.digest(policy)
    seeds = judging.seeds_of(sha256)
    rows = [f"{sha256},{seed},7.0,5" for seed in seeds]

    def write_finals(rows):
        (tmp_path / "run" / "final.csv").write_text("\n".join([",".join(finals.COLUMNS), *rows, ""]))
        return cards.write(run, tmp_path / "run").read_text()

    judged = f"| return | 7.0, 95 % interval [7.0, 7.0], {len(seeds)} judging episodes |"
    assert judged in write_finals(rows)
    latest = run_folder.latest_returns(run_folder.table(tmp_path / "run", "evaluations"))
    for other_rows in ([row.replace(sha256, "0" * 64) for row in rows], rows[:-1]):
        card = write_finals(other_rows)
        assert f"| return | {latest.mean():.1f}, " in card and "10 episodes of the latest evaluation |" in card
    (tmp_path / "run" / "final.csv").write_text(f"policy_sha256,return,length\n{sha256},7.0,5\n")
    with pytest.raises(ValueError, match=r"final\.csv: no table of a run: expected a column seed$"):
        cards.write(run, tmp_path / "run")


def test_the_program_draws_the_policy(folder):
    module_folder = pathlib.Path(tiny_studies.__file__).parent
    done = programs.run("-m", "arc_suite", "card", str(folder), "--modules=tiny_studies", path=module_folder)
    assert programs.passed(done) == f"wrote {folder / 'README.md'}\n"
    assert (folder / "picture.png").stat().st_size > 5000
    assert "![picture.png](picture.png)" in (folder / "README.md").read_text()


def test_what_is_no_run_is_one_line(tmp_path):
    programs.refused(programs.arc_suite("card"), "arc-suite card: expected the folder of a run, such as")
    line = f"arc-suite card: {tmp_path}: no folder of a run\n"
    programs.refused(programs.arc_suite("card", str(tmp_path)), line)
