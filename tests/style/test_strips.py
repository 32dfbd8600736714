"""Strips of frames: equal phases of one gait cycle, the same for every policy, and what there is of a short episode."""

import gaitless
import numpy as np
import pytest
from PIL import Image

from arc_suite.cpg import Demonstrator
from arc_suite.envs.dm import load
from arc_suite.policies import alone, policy
from arc_suite.robots import ROBOTS
from arc_suite.style import strips


def frames_of(picture):
    width = strips.WIDTH + strips.GAP
    assert picture.shape == (strips.HEIGHT, strips.FRAMES * width - strips.GAP, 3)
    return [picture[:, start : start + strips.WIDTH] for start in range(0, picture.shape[1], width)]


@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("length", [1000, 40, 20])
def test_frames_are_at_equal_phases(robot, length):
    """Of the task's own clock, to half a control step; all in one cycle, as late a one as there is."""
    task = load(robot, "walk").task.definition
    turn = task.parameters.gait_frequency * task.scene.control_timestep
    found = strips.ticks(task.parameters.gait_frequency, task.scene.control_timestep, length)
    assert len(found) == strips.FRAMES
    phases = task.clock.at(task.clock.phases, found) / (2.0 * np.pi)
    late = (phases - np.arange(strips.FRAMES) / strips.FRAMES + 0.5) % 1.0 - 0.5
    assert np.abs(late).max() <= 0.5 * turn + 1e-9
    assert 1.0 - 2.0 / strips.FRAMES < turn * (found[-1] - found[0]) < 1.0
    assert found[-1] <= length
    assert round(turn * found[0]) == strips.SETTLED or found[-1] + round(1.0 / turn) > length


@pytest.mark.slow
def test_a_strip_shows_the_walk_at_its_ticks(tmp_path):
    environment, walker = load("tick", "walk"), Demonstrator("tick")
    picture = strips.strip(environment, walker, seed=3)
    frames = frames_of(picture)
    assert len({frame.tobytes() for frame in frames}) == strips.FRAMES
    at = strips.ticks(1.5, environment.control_timestep(), 1000)
    act, time_step = alone(walker, 3), environment.reset(3)
    for tick in range(at[-1] + 1):
        if tick in at:
            view = environment.physics.render(strips.HEIGHT, strips.WIDTH, strips.CAMERA, quality="still")
            assert np.array_equal(frames[at.tolist().index(tick)], view)
        time_step = environment.step(act(time_step))

    strips.write(tmp_path / "strip.png", picture)
    written = np.asarray(Image.open(tmp_path / "strip.png").convert("RGB")).astype(int)
    assert written.shape == picture.shape
    assert np.abs(written - picture).mean() < 8.0
    assert (tmp_path / "strip.png").stat().st_size < 60_000


@pytest.mark.slow
def test_what_an_episode_has_not_is_white():
    """Seven steps are the first half of a cycle of 13."""
    environment = load("tick", "walk", {"time_limit": 0.35})
    frames = frames_of(strips.strip(environment, policy("zero", "tick")))
    assert [bool((frame == 255).all()) for frame in frames] == [False] * 4 + [True] * 2


@pytest.mark.slow
def test_policies_that_follow_commands_walk_ahead():
    """The schedule of seed 0 begins with a stop, at which the gait clock rests."""
    environment = load("queen", "steer")
    frames = frames_of(strips.strip(environment, policy("cpg", "queen", "steered", task=environment.task.definition)))
    assert len({frame.tobytes() for frame in frames}) == strips.FRAMES
    memory = environment.task.memory.core
    assert memory.desired.tolist() == [1.0, 0.0, 0.0]
    assert memory.tick == strips.ticks(1.5, environment.control_timestep(), 1000)[-1]
    assert np.hypot(*memory.place[:2]) > 0.5


def test_without_a_gait_there_is_none():
    with gaitless.registered():
        assert strips.strip(load("queen", "stay"), Demonstrator("queen")) is None
    assert strips.strip(load("queen", "walk", {"gait_frequency": 0.0}), Demonstrator("queen")) is None
