"""Datasets of agents: from a run's checkpoints, by quality, replayed bit by bit."""

import functools
import pathlib

import numpy as np
import programs
import pytest
import tiny_studies
from refusals import refused
from tqdm import tqdm

from arc_suite import data, evaluation, policies
from arc_suite.learning.agents import run_folder
from arc_suite.learning.agents.training import train
from arc_suite.policies import checkpoints

ROOT = pathlib.Path(__file__).parents[3]
silent = functools.partial(tqdm, disable=True)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Folder of a run with checkpoints at 100, 200 and 300, of rising return."""
    folder = tmp_path_factory.mktemp("runs") / "climb"
    train(tiny_studies.WITH_NUMPY.runs[0].configuration, folder, progress=silent)
    return folder


@pytest.fixture
def collected(run, tmp_path, monkeypatch):
    """A function that collects from the run by the program."""
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))

    def collect(*flags):
        command = ["collect", "--robot=tick", f"--policy={run}", "--set=time_limit=2", "--episodes=6", "--threads=1"]
        return programs.run("-m", "arc_suite", *command, *flags, cwd=ROOT)

    return collect


@pytest.mark.slow
def test_a_run_keeps_the_policy_of_each_evaluation(run):
    table = run_folder.table(run, "evaluations")
    agents = checkpoints.agents(run / "checkpoints")
    assert [agent.steps for agent in agents] == [100, 200, 300]
    for agent in agents:
        assert (agent.algorithm, agent.seed) == ("tiny_studies:climb", 0)
        assert agent.mean_return == table["return"][table["step"] == agent.steps].mean()
        assert checkpoints.agents(checkpoints.at(run, agent.steps)) == [agent]
    assert (run / "checkpoints/300/policy.npz").read_bytes() == (run / "policy.npz").read_bytes()


def test_checkpoints_take_turns(run):
    """From seed to seed, and each does what it does alone."""
    both = policies.policy(run / "checkpoints", "tick", num_envs=3)
    alone = [policies.policy(checkpoints.at(run, step), "tick", num_envs=3) for step in (100, 200, 300)]
    sizes = alone[0].blocks
    observation = {name: np.full((3, size), 0.3) for name, size in sizes.items()}
    both.reset(range(3), [4, 2, 0])
    actions = both.act(observation, np.zeros(3))
    for which, turn in enumerate((1, 2, 0)):
        np.testing.assert_array_equal(actions[which], alone[turn].act(observation, np.zeros(3))[which])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("flag", "label", "steps"),
    [
        ("--checkpoint=200", "200", [200]),
        ("--quality=expert", "expert", [300]),
        ("--quality=replay", "replay", [100, 200, 300]),
    ],
)
def test_a_dataset_of_an_agent(flag, label, steps, run, collected):
    """Its id and metadata name its policy, and it replays bit-exactly."""
    programs.passed(collected(flag))
    (dataset_id,) = data.ids.existing()
    assert f"/tiny_studies_climb-0-{label}-set" in dataset_id
    dataset = data.open(dataset_id)
    agents = dataset.metadata["arc_suite"]["agents"]
    assert [agent["steps"] for agent in agents] == steps
    assert all(agent.keys() == {"algorithm", "steps", "seed", "mean_return"} for agent in agents)
    assert len(dataset) == 6
    assert data.verify(dataset_id, threads=1, progress=silent) == 6
    environment = dataset.settings.setup.load()
    for summary in dataset.summaries():
        policy = policies.policy(checkpoints.at(run, steps[summary["seed"] % len(steps)]), "tick")
        total = evaluation.run(environment, policy, summary["seed"]).total
        assert summary["return"] == pytest.approx(total, abs=1e-6), "of the checkpoint whose turn it is"


@pytest.mark.slow
def test_random_is_a_quality_too(collected):
    programs.passed(collected("--quality=random"))
    (dataset_id,) = data.ids.existing()
    assert "/tiny_studies_climb-0-random-set" in dataset_id
    assert data.open(dataset_id).settings.policy == "random"


def earning(folder, means):
    """Write agents with mean returns by step."""
    for step, mean in means.items():
        (path := folder / "checkpoints" / str(step)).mkdir(parents=True)
        checkpoints.save(path, checkpoints.Agent("sac", step, 3, mean))


def test_medium_is_the_first_that_earns_a_third_of_the_best(tmp_path):
    earning(tmp_path, {10: 5.0, 20: 39.0, 30: 50.0, 40: 120.0, 50: 90.0})
    found = {quality: checkpoints.of_quality(tmp_path, quality) for quality in checkpoints.QUALITIES}
    at = {step: str(tmp_path / "checkpoints" / str(step)) for step in (30, 50)}
    assert found == {"random": "random", "medium": at[30], "expert": at[50], "replay": str(tmp_path / "checkpoints")}


def test_of_a_run_that_earned_nothing_none_is_medium(tmp_path):
    earning(tmp_path, {10: -50.0, 20: -30.0})
    with refused(f"{tmp_path}: none is medium, as the best earns -30.0; there are random, expert and replay"):
        checkpoints.of_quality(tmp_path, "medium")


@pytest.mark.parametrize(
    ("flags", "line"),
    [
        (["--checkpoint=150"], "keeps no checkpoint at 150 (there are: 100, 200, 300)"),
        (["--checkpoint=100", "--quality=medium"], "expected one of --checkpoint and --quality, got both"),
        (["--policy=runs/none", "--quality=medium"], "runs/none: keeps no checkpoints"),
        (["--policy=cpg", "--quality=random"], "cpg: keeps no checkpoints"),
    ],
)
def test_errors_are_one_line(flags, line, collected):
    done = collected(*flags)
    assert done.returncode == 1 and not done.stdout.count("episodes")
    assert done.stderr.startswith("arc-suite collect: ") and done.stderr.endswith(f"{line}\n"), done.stderr
