"""Runs side by side: calls of equal shape are one program, and a run learns what it would learn alone."""

import time

import numpy as np
import pytest

jax = pytest.importorskip("jax", reason="of the extra agents: make check-agents")

import programs
import tiny_studies
from conftest import small
from test_study import FIXTURES, contents

from arc_suite.agents import networks, study_runner, study_states, study_together, together
from arc_suite.agents.learner import Diverged
from arc_suite.agents.off_policy import OffPolicy
from arc_suite.agents.studies import Row

WIDTH = 4


def seeds(learner, tmp_path, name, count):
    return [
        learner(small(name, phase_every=20), seed=seed, folder=tmp_path / f"{name}-{seed}") for seed in range(count)
    ]


def learnt(agent):
    return {name: np.array(array) for name, array in networks.named("state", agent._state).items()}


def side_by_side(agents, steps, width=WIDTH):
    def work(agent):
        while agent.step < steps:
            yield from agent.calls(steps)

    together.together([work(agent) for agent in agents], width)
    return [learnt(agent) for agent in agents]


@pytest.mark.parametrize("name", ["sac", "sope_eo", "sope"])
def test_a_run_learns_what_it_learns_alone(name, learner, tmp_path):
    """To the rounding of programs that are compiled otherwise, in phases too; steps of Adam are 0.0003 at most."""
    agents = seeds(learner, tmp_path, name, 3)
    found = side_by_side(agents, 40)
    for seed, (agent, several) in enumerate(zip(agents, found, strict=True)):
        single = learner(small(name, phase_every=20), seed=seed, folder=tmp_path / f"alone-{seed}")
        while single.step < 40:
            single.advance(40)
        assert agent._count == single._count and agent._count["updates"] >= 40
        for key, array in learnt(single).items():
            np.testing.assert_allclose(several[key], array, rtol=1e-3, atol=1e-4, err_msg=key)
    assert not np.array_equal(found[0]["state/log_alpha"], found[1]["state/log_alpha"])


def test_what_others_do_changes_no_bit(learner, tmp_path):
    """Nor how many there are; beyond the width there are several programs."""
    several = side_by_side(seeds(learner, tmp_path / "a", "sope", 3), 45, width=2)
    for place, alone in enumerate(seeds(learner, tmp_path / "b", "sope", 3)):
        (single,) = side_by_side([alone], 45, width=2)
        assert several[place].keys() == single.keys()
        assert [name for name in single if not np.array_equal(several[place][name], single[name])] == []


def test_calls_of_equal_shape_are_one_program(learner, tmp_path, monkeypatch):
    counts, many = [], together._many
    monkeypatch.setattr(together, "_many", lambda *inputs: counts.append(inputs[3]) or many(*inputs))
    for count in (1, WIDTH):
        counts.clear()
        side_by_side(seeds(learner, tmp_path / str(count), "sac", count), 30)
        assert counts == [WIDTH] * (30 + 9), "30 updates, and actions of the policy after the first 21 steps"


def rows(*names):
    return [tiny_studies._of_the_paper(name, seed) for name, seed in names]


def made(several, folder, shown=lambda states: None):
    return study_together.run(several, folder / "runs", folder / "results", WIDTH, shown)


def test_a_study_that_is_broken_off_goes_on_to_the_bit(tmp_path, monkeypatch):
    monkeypatch.setattr(study_states, "_EVERY", 0.0)
    several = rows(("sac", 0), ("sope_eo", 0), ("sac", 1), ("sope_eo", 1))
    assert {each.word for each in made(several, tmp_path / "whole")} == {"finished"}

    looks = []

    def interrupting(states):
        looks.append(states)
        if any(each.step >= 200 for each in states):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        made(several, tmp_path / "broken", interrupting)
    assert [each.word for each in looks[-1]] == ["running", "waiting", "running", "waiting"]
    assert [each.word for each in made(several, tmp_path / "broken")] == ["finished"] * 4
    whole, broken = contents(tmp_path / "whole"), contents(tmp_path / "broken")
    assert len([path for path in whole if path.endswith("evaluations.csv")]) == 4
    assert whole.keys() == broken.keys()
    assert [path for path in whole if whole[path] != broken[path]] == []


@pytest.mark.parametrize("error", [Diverged, RuntimeError])
def test_a_run_that_fails_leaves_the_others(error, tmp_path, monkeypatch):
    several = [*rows(("sac", 0), ("sac", 1)), Row("tick", "sac", 300, 7, numbers={"learning_rte": 1.0})]
    action = OffPolicy._action

    def failing(agent):
        if agent._seed == 1 and agent.step == 150:
            raise error("the learner diverged: its action is not finite at step 150")
        return action(agent)

    monkeypatch.setattr(OffPolicy, "_action", failing)
    assert [each.word for each in made(several, tmp_path)] == ["finished", "failed", "failed"]
    logs = [(tmp_path / "runs" / f"{row.name}.log").read_text() for row in several]
    reason = "the learner diverged: its action is not finite at step 150\n"
    assert logs[0] == ""
    if error is Diverged:
        assert logs[1] == f"arc-suite train: {reason}"
    else:
        assert logs[1].startswith("Traceback") and logs[1].endswith(f"RuntimeError: {reason}")
    assert logs[2].startswith(
        "arc-suite train: unknown number of the row 'learning_rte'; did you mean 'learning_rate'?"
    )


def test_what_another_process_makes_is_waited_for(tmp_path, monkeypatch):
    """And taken over where that process ends without finishing it."""
    monkeypatch.setattr(study_together, "_PAUSE", 0.0)
    several, words = rows(("sac", 0), ("sac", 1)), []
    (tmp_path / "runs").mkdir()
    held = study_runner.claimed(tmp_path / "runs" / f"{several[0].name}.log")

    def letting_go(states):
        words.append([each.word for each in states])
        if states[1].word == "finished":
            held.close()

    assert [each.word for each in made(several, tmp_path, letting_go)] == ["finished", "finished"]
    assert ["elsewhere", "running"] in words and ["running", "finished"] in words


def test_the_processor_is_shared(tmp_path):
    """Its seconds are those of the process, and not of each run; runs begin and end one after the other."""
    several = rows(("sac", 0), ("sac", 1), ("sac", 2))
    before = time.process_time()
    states = made(several, tmp_path)
    assert 0.0 < sum(each.cpu for each in states) < 1.5 * (time.process_time() - before)


def test_groups_learn_alike():
    """Robots with as many legs and joints may be in one; algorithms, tasks and numbers tell apart."""
    several = [
        Row(robot, name, 100, seed) for seed in (0, 1) for robot in ("tick", "leaper") for name in ("sac", "speq")
    ]
    several += [Row("queen", "sac", 100), Row("tick", "sac", 100, 2, task="steer")]
    several += [
        Row("tick", "sac", 100, 3, task_kwargs={"time_limit": 2.0}),
        Row("tick", "sac", 100, 4, numbers={"batch": 8}),
    ]
    found = [[row.name for row in group] for group in study_together.groups(several, 2)]
    assert found == [
        ["tick-walk-sac-0", "tick-walk-sac-1"],
        ["queen-walk-sac-0"],
        ["tick-walk-speq-0", "tick-walk-speq-1"],
        ["leaper-walk-sac-0", "leaper-walk-sac-1"],
        ["leaper-walk-speq-0", "leaper-walk-speq-1"],
        *(["tick-steer-sac-2"], ["tick-walk-sac-3"], ["tick-walk-sac-4"]),
    ]


@pytest.mark.parametrize("flag", ["--jobs=2", "--submit=2"])
def test_one_process_or_several(flag, tmp_path):
    done = programs.run(
        "-m", "arc_suite", "study", "tiny_studies:WITH_JAX", "--together=2", flag, cwd=tmp_path, path=FIXTURES
    )
    line = "arc-suite study: --together, --jobs, --submit: one process, several, or a cluster; give one of them\n"
    assert (done.returncode, done.stdout, done.stderr) == (1, "", line)
