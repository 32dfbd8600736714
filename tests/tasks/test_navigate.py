"""Navigate: goals and pillars as they are drawn, seen, reached and hit."""

import math
import types

import mujoco
import numpy as np
import pytest
from episodes import begun, opened
from numpy.testing import assert_allclose, assert_array_equal
from tiers import tiers

import arc_suite
from arc_suite import rotations
from arc_suite.arenas.pillars import COUNT, PITCH, RADIUS, SHIFT
from arc_suite.cpg import Demonstrator
from arc_suite.robots import ROBOTS
from arc_suite.tasks import command, sensors
from arc_suite.tasks.fitting import reach


def drawn(robot="tick", seeds=range(50)):
    task = arc_suite.load(robot, "navigate").task.definition
    return task, [task.start(np.random.RandomState(seed), None) for seed in seeds]


def fields(environment):
    data = environment.physics.data.ptr
    names = environment.task.definition.reads
    return types.SimpleNamespace(**{name: getattr(data, name).copy() for name in names})


@pytest.mark.parametrize("robot", tiers(ROBOTS, lambda robot: robot == "leaper"))
def test_pillars_leave_room_and_goals_are_apart(robot):
    task, starts = drawn(robot)
    unit = reach(ROBOTS[robot])
    assert task.scene.arena.unit == unit
    for start in starts:
        pillars, goals = start.memory.ground.pillars / unit, start.memory.command.goals / unit
        assert_array_equal(start.mocap_pos[:, :2], start.memory.ground.pillars)
        apart = np.hypot(*np.moveaxis(pillars[:, None] - pillars, -1, 0)) + 99.0 * np.eye(COUNT)
        assert apart.min() >= PITCH - 2.0 * SHIFT >= 2.3 + 2.0 * RADIUS
        places = np.concatenate([np.zeros((1, 2)), goals])
        legs = np.hypot(*np.diff(places, axis=0).T)
        assert legs.min() > 3.5 and legs.max() < sensors.FAR
        assert np.hypot(*np.moveaxis(places[:, None] - pillars, -1, 0)).min() > 2.0
        assert not (places[2:] == places[:-2]).all(axis=-1).any(), "nobody is sent straight back"
    assert len({start.memory.command.goals.tobytes() for start in starts}) == len(starts)
    moves = np.concatenate([np.diff(start.memory.command.goals, axis=0) for start in starts])
    across = moves.all(axis=-1).mean()
    assert 0.3 < across < 0.6, "some ways lead between pillars, some straight at one"


@pytest.mark.parametrize("robot", ["queen", "tick"])
def test_ranges_are_those_of_mujocos_rays(robot):
    environment = arc_suite.load(robot, "navigate", {"random": 1})
    demonstrator, timestep = Demonstrator(robot, "steered"), environment.reset()
    task, hit, seen = environment.task.definition, np.zeros(1, np.int32), 0
    for step in range(40):
        timestep = environment.step(demonstrator(timestep))
        if step % 8:
            continue
        physics, memory = environment.physics, environment.task.memory
        unit = task.scene.arena.unit
        for ray, share in zip(sensors.RAYS.T, timestep.observation["ranges"], strict=True):
            start = np.array([*memory.core.place[:2], 0.5 * task.scene.arena.top])
            direction = np.array([*rotations.to_heading_frame(ray, -memory.core.place[2]), 0.0])
            group = np.array([1, 0, 0, 0, 0, 0], np.uint8)
            # The body's own parts are in the way of rays from within it, so that rays go on behind them.
            far = 0.0
            while True:
                length = mujoco.mj_ray(
                    physics.model.ptr, physics.data.ptr, start + far * direction, direction, group, 1, -1, hit
                )
                if length < 0.0 or physics.model.geom(int(hit[0])).name.startswith("floor_pillar"):
                    break
                far += length + 1e-6
            far = sensors.SIGHT * unit if length < 0.0 else far + length
            assert min(far / (sensors.SIGHT * unit), 1.0) == pytest.approx(share, abs=1e-4)
            seen += share < 1.0
    assert seen > 10


def test_bearing_and_distance_of_the_goal():
    environment, task, memory = opened("tick", "navigate")
    unit = task.scene.arena.unit

    def observed(goal, place):
        own = memory.command._replace(goals=np.tile(goal, (command.GOALS, 1)))
        return task.command.observe(task.context, task.command.begin(task.context, own, place))["goal"]

    for bearing, distance in ((0.3, 2.0), (-2.0, 5.0), (3.0, 7.5)):
        place = np.array([1.0, -2.0, 0.7])
        goal = place[:2] + distance * unit * np.array([math.cos(0.7 + bearing), math.sin(0.7 + bearing)])
        assert_allclose(observed(goal, place), (math.cos(bearing), math.sin(bearing), min(distance / 7.0, 1.0)))
    assert_allclose(observed(goal, np.array([*goal, 0.0])), np.zeros(3), atol=1e-9)


def moved(environment, place):
    """The memory after a step that ends with the torso at a place (2,), m."""
    data = fields(environment)
    data.xpos[environment.task.definition.scene.layout.torso, :2] = place
    return environment.task.definition.after(environment.task.memory, environment.task.definition.read(data))


def test_a_goal_that_is_reached_counts_and_gives_way_to_the_next():
    environment, task, memory = opened("tick", "navigate")
    readings, unit = task.read(environment.physics.data.ptr), task.scene.arena.unit
    goals, start = memory.command.goals, memory.core.place[:2]
    near = moved(environment, goals[0] + (0.0, 0.71 * unit))
    assert (near.command.reached, task.terms(near, readings)["goal"]) == (0, 0.0)
    there = moved(environment, goals[0] + (0.0, 0.69 * unit))
    assert (there.command.reached, task.terms(there, readings)["goal"]) == (1, 1.0)
    progress = task.terms(there, readings)["progress"]
    assert there.command.speed_share > 1.0 >= progress > 0.99, "more than the target velocity earns no more"
    assert_allclose(np.hypot(*there.command.to_goal), np.hypot(*(goals[1] - there.core.place[:2])))
    away = moved(environment, start - (goals[0] - start)).command.speed_share
    far, leak = np.hypot(*(goals[0] - start)), task.context.leak
    assert away == pytest.approx(-leak * far / task.context.pace, rel=0.1), "a step back costs its whole displacement"
    step = task.context.units[0] * task.scene.control_timestep
    direction = (goals[0] - start) / np.hypot(*memory.command.to_goal)
    assert moved(environment, start + 0.4 * step * direction).command.speed_share == pytest.approx(0.4 * leak)


def test_at_the_end_of_the_chain_it_goes_back():
    environment, task, memory = opened("tick", "navigate")
    order = []
    place = memory.core.place
    for reached in range(35):
        seen = task.command.begin(task.context, memory.command._replace(reached=reached), place)
        far = np.hypot(*(memory.command.goals - place[:2]).T)
        order.append(set(np.flatnonzero(np.isclose(far, np.hypot(*seen.to_goal)))))
    expected = [*range(16), *range(14, -1, -1), *range(1, 5)]
    assert all(number in numbers for number, numbers in zip(expected, order, strict=True))


def test_a_collision_is_counted_once_on_every_way():
    environment, task, memory = opened("tick", "navigate")
    readings = task.read(environment.physics.data.ptr)
    assert not readings.touches
    data = fields(environment)
    data.cfrc_ext[-3, 4] = 1e-3
    touching = task.read(data)
    assert touching.touches
    counts = []
    for touch, arrives in ((1, 0), (0, 0), (1, 0), (1, 1), (0, 0), (1, 0), (0, 1), (0, 1)):
        place = memory.command.goals[memory.command.reached] if arrives else np.zeros(2)
        felt = (touching if touch else readings)._replace(frame_position=np.array([*place, 0.2]))
        memory = task.after(memory, felt)
        counts.append((int(memory.command.reached), int(memory.ground.collisions)))
    assert counts == [(0, 1), (0, 1), (0, 1), (1, 1), (1, 1), (1, 2), (2, 2), (3, 2)]


def test_a_pillar_in_the_way_is_touched_and_stops_a_body():
    environment = arc_suite.load("tick", "navigate", {"random": 0})
    timestep, demonstrator = environment.reset(), Demonstrator("tick", "steered")
    memory, task = environment.task.memory, environment.task.definition
    unit, heading = task.scene.arena.unit, memory.core.place[2]
    ahead = np.array([math.cos(heading), math.sin(heading)])
    environment.physics.data.mocap_pos[0, :2] = 2.0 * unit * ahead
    chain = memory.command._replace(goals=np.tile(9.0 * unit * ahead, (command.GOALS, 1)))
    environment.task.memory = memory._replace(command=task.command.begin(task.context, chain, memory.core.place))
    for _ in range(100):
        timestep = environment.step(demonstrator(timestep))
        assert environment.physics.data.qpos[:2] @ ahead < 2.0 * unit
        if timestep.last():  # legs climb the pillar
            break
    progress = environment.task.progress
    assert (progress["goals"], progress["collisions"]) == (0.0, 1.0)


@pytest.mark.slow
def test_pictures_show_the_goal_and_pillars():
    single, task, memory = opened("tick", "navigate")
    shown = single.physics.render(60, 80)
    disk = task.markers(memory, task.read(single.physics.data.ptr))[-1]
    assert (disk.shape, disk.radius) == ("cylinder", 0.7 * task.context.reach)
    assert_array_equal(disk.start[:2], memory.command.goals[0])
    single.physics.data.mocap_pos[:, :2] += 100.0
    assert not np.array_equal(single.physics.render(60, 80), shown)


def test_it_has_no_stick():
    environment = begun("tick", "navigate")
    with pytest.raises(ValueError, match="^command 'command': task navigate has no commands$"):
        environment.command("command", (1.0, 0.0, 0.0))
