"""Lanes of ground: what is drawn, seen and asked for, how an episode ends, and how a curriculum climbs."""

import dataclasses
import hashlib
import itertools

import gymnasium
import numpy as np
import pytest
import rays
import twins
from crossings import walked
from episodes import opened
from numpy.testing import assert_allclose, assert_array_equal
from refusals import refused
from tiers import never, tiers, turns

import arc_suite
from arc_suite.arenas import ARENAS, Arena, terrain
from arc_suite.bodies import generator
from arc_suite.cpg import Demonstrator
from arc_suite.envs.prepare import prepare_task
from arc_suite.envs.vector import VectorEnv
from arc_suite.robots import ROBOTS
from arc_suite.simulation.model import compile_model
from arc_suite.tasks import TASKS
from arc_suite.tasks.command import scheduled_value
from arc_suite.tasks.contract import STEPS
from arc_suite.tasks.ground import LEVELS, Lanes, Stream, next_level
from arc_suite.tasks.sensors import FORWARD, LEFT, SCAN

KINDS = ("rough", "slopes", "stairs", "gaps")
GROUNDS = [name for name in ARENAS if name != "flat"]
every_kind = pytest.mark.parametrize("kind", tiers(KINDS, lambda kind: kind == "gaps"))


def inner(memory):
    """The memory of the task itself, without modifiers."""
    return getattr(memory, "task", memory)


@pytest.mark.parametrize(
    ("name", "settings", "kinds", "lanes"),
    [
        ("course", {}, KINDS, 8),
        ("stairs", {"rise": 0.07, "width": 0.23}, ["stairs"], 4),
        pytest.param("course", {"curriculum": True}, KINDS, 4 * LEVELS, marks=pytest.mark.slow),
        pytest.param("stairs", {}, ["stairs"], 4, marks=pytest.mark.slow),
    ],
)
def test_height_is_that_of_rays_in_every_lane(name, settings, kinds, lanes):
    task, model = prepare_task("leaper", name, settings)
    arena, random = task.scene.arena, np.random.RandomState(0)
    assert len(arena.lanes) == lanes
    assert {kind for kind, _ in arena.lanes} == set(kinds)
    for lane in range(lanes):
        places = random.uniform((-terrain.BACK, -11.9), (arena.length, 11.9), (40, 2)) * arena.unit
        rays.assert_heights(arena, model, places + (0.0, arena.start(lane)), arena.unit)


# Of (robot's heights at fixed places) by kind of ground: the ground of a setting never changes.
DIGESTS = ("eeeaf6d1f9e96022", "20855599f2a44947", "65c2f128f3489abc", "c388d4d14fd3b8b6")


@every_kind
def test_ground_is_a_function_of_its_settings(kind):
    def heights(**settings):
        arena = prepare_task("queen", kind, settings)[0].scene.arena
        x, y = np.random.RandomState(0).uniform((-3.0, -80.0), (40.0, 80.0), (500, 2)).T
        return np.round(arena.height(x * arena.unit, y * arena.unit), 9)

    assert hashlib.sha256(heights().tobytes()).hexdigest()[:16] == DIGESTS[KINDS.index(kind)]
    assert_array_equal(heights(), heights(terrain_seed=0, difficulty=2.0 / 3.0))
    assert not np.array_equal(heights(), heights(terrain_seed=1))
    assert abs(heights(difficulty=1.0)).max() > abs(heights(difficulty=0.3)).max() or kind == "gaps"


def profile(robot, kind, **settings):
    """Heights, m, along the middle of the first lane, every centimeter."""
    arena = prepare_task(robot, kind, settings)[0].scene.arena
    x = np.arange(0.0, 12.0, 0.01)
    return arena.height(x, arena.start(0) + 0.0 * x)


def test_obstacles_in_meters_are_the_same_for_all_bodies():
    """Queen stands 0.45 m high, Tick 0.21 m; edges may be off by rounding of the places in the test."""
    for robot in ("queen", "tick"):
        height = ROBOTS[robot].torso.standing_height
        stairs = profile(robot, "stairs", rise=0.06, width=0.3)
        up = np.flatnonzero(np.diff(stairs))
        assert_allclose(np.unique(stairs), 0.06 * np.arange(5), atol=1e-12)
        assert_allclose(np.diff(up[:4]), 30.0, atol=1.0)
        trench = profile(robot, "gaps", width=0.11) < 0.0
        first, last = np.flatnonzero(np.diff(trench))[:2]
        assert abs(last - first - 11) <= 1
        slopes = profile(robot, "slopes", slope=0.2)
        assert_allclose(slopes.max(), 6.0 * height * np.tan(0.2), atol=1e-2)
        rough = profile(robot, "rough", rise=0.05)
        assert 0.03 < rough.max() <= 0.05


def test_a_rise_in_meters_equals_its_difficulty():
    height = ROBOTS["queen"].torso.standing_height
    assert_allclose(
        profile("queen", "stairs", rise=0.3 * height), profile("queen", "stairs", difficulty=1.0), atol=1e-12
    )


@pytest.mark.parametrize(
    ("task", "settings", "message"),
    [
        ("stairs", {"rise": 0.1, "difficulty": 1.0}, "difficulty: expected none with rise=0.1, got 1.0"),
        ("gaps", {"width": 0.1, "curriculum": True}, "curriculum: expected none with width=0.1, got True"),
        ("stairs", {"rise": -0.1}, "rise: expected a number from 0 to 100, got -0.1"),
        ("slopes", {"slope": "steep"}, "slope: expected a number from 0 to 1.2, got 'steep'"),
        ("stairs", {"width": 0.01}, "width: expected a finite number of at least 0.02"),
        ("course", {"rise": 0.1}, "setting 'rise': course has none; rough, stairs, leap, roam have it"),
        ("rough", {"difficulty": 1.5}, "difficulty: expected a number from 0 to 1, got 1.5"),
        ("rough", {"curriculum": 1}, "curriculum: expected true or false, got 1"),
        ("rough", {"level": 10}, "level: expected an integer from 0 to 9, got 10"),
        ("rough", {"terrain_seed": -1}, "terrain_seed: expected an integer from 0"),
    ],
)
def test_settings_that_do_not_fit_are_one_line(task, settings, message):
    with refused(message, begins=True):
        arc_suite.load("tick", task, settings)


def test_a_lane_is_the_same_beside_others():
    body, places = ROBOTS["queen"], np.linspace(0.0, 20.0, 300)
    alone = terrain.make_lanes(body, {"gaps": 1}, 40.0)
    beside = terrain.make_lanes(body, {"rough": 2, "gaps": 2}, 40.0)
    assert beside.lanes[2] == alone.lanes[0]
    heights = [arena.height(places, arena.start(lane) + 0.0 * places) for arena, lane in ((alone, 0), (beside, 2))]
    assert heights[0].any()
    assert_array_equal(*heights)


def test_a_height_field_lies_over_the_plane_below_stairs():
    """Of two surfaces at one height both would touch a foot."""
    model = compile_model(ROBOTS["tick"], terrain.make_lanes(ROBOTS["tick"], {"rough": 1, "stairs": 1}, 20.0))
    assert model.geom("floor_bottom").pos[2] < model.geom("floor").pos[2]


@pytest.mark.parametrize("kind", ["rough", "slopes"])
def test_difficulty_0_is_level(kind):
    arena = prepare_task("bastion", kind, {"difficulty": 0.0})[0].scene.arena
    x, y = np.random.RandomState(0).uniform(-3.0, 12.0, (2, 100))
    assert not arena.height(x, y).any()


@pytest.mark.long
@pytest.mark.parametrize("robot", tiers(ROBOTS, never, lambda robot: robot == "bastion"))
def test_on_level_lanes_demonstrators_earn_what_they_do_on_the_plane(robot):
    level = terrain.make_lanes(ROBOTS[robot], {"rough": 3}, levels=(0.0,))
    returns = []
    for arena in (level, "flat"):
        envs = VectorEnv(
            ROBOTS[robot], "walk", 6, task_kwargs={"arena": arena, "base_noise": 0.0, "joint_noise": 0.0}
        )  # none is lifted
        returns.append(sum(rewards.mean() for rewards, *_ in walked(envs, "tuned", 300)))
    # Bastion's speed sways more on a height field, which touches a foot in several points: 2.4 % once it walks.
    assert abs(returns[0] / returns[1] - 1.0) < (0.04 if robot == "bastion" else 0.01)


@pytest.mark.parametrize(
    "name",
    tiers(
        [name for name, task in TASKS.items() if isinstance(getattr(task, "ground", None), Lanes)],
        lambda name: name == "course",
    ),
)
def test_an_episode_starts_in_a_lane_clear_of_the_ground(name):
    environment, task, _ = opened("bastion", name)
    arena, radii = task.scene.arena, np.array([leg.foot.radius for leg in task.scene.body.legs])
    lanes = set()
    for _ in range(40):
        environment.reset()
        memory, data = inner(environment.task.memory), environment.physics.data.ptr
        lanes.add(float(memory.ground.center_y))
        assert abs(data.qpos[1] - memory.ground.center_y) < 6.5 * arena.unit
        assert abs(memory.core.place[2]) < (0.5 if name != "roam" else 3.2)
        assert (task.read(data).foot_heights - radii).min() > 0.0099 * arena.unit
    assert len(lanes) > 0.6 * min(40, len(arena.lanes))
    assert lanes <= {arena.start(lane) for lane in range(len(arena.lanes))}


def test_the_scan_is_the_ground_about_the_torso():
    environment, task, _ = opened("queen", "gaps", difficulty=1.0)
    demonstrator, timestep = Demonstrator("queen", "steered"), environment.reset(seed=3)
    for _ in range(60):
        timestep = environment.step(demonstrator(timestep))
    memory, data, arena = environment.task.memory, environment.physics.data.ptr, task.scene.arena
    scan = timestep.observation["scan"]
    assert scan.shape == (len(FORWARD) * len(LEFT),) == (175,)
    heading = memory.core.place[2]
    for (forward, left), value in zip(SCAN.T * task.context.reach, scan, strict=True):
        x = data.qpos[0] + np.cos(heading) * forward - np.sin(heading) * left
        y = data.qpos[1] + np.sin(heading) * forward + np.cos(heading) * left
        under = (arena.height(x, y) - data.qpos[2]) / arena.unit + 1.0
        assert value == pytest.approx(np.clip(under, -1.0, 1.0), abs=1e-12)
    assert scan.min() < -0.4 < 0.0 < scan.max() + 0.3, "a trench is in sight, and land"


def test_the_command_leads_along_the_lane():
    _, task, memory = opened("tick", "stairs")

    def desired(heading, live=(np.nan,) * 3):
        own = memory.command._replace(live=np.array(live))
        return task.command.desired(task.context, own, 0, np.array([0.0, 0.0, heading]))

    for heading in (-2.0, -0.2, 0.0, 0.3):
        forward, left, turn = desired(heading)
        assert_allclose(
            (np.cos(heading), np.sin(heading)) @ np.array([[forward, left], [-left, forward]]), (1.0, 0.0), atol=1e-12
        )
        assert turn == np.clip(-heading * task.context.reach / task.scene.arena.unit, -1.0, 1.0)
    player = desired(0.3, (0.2, np.nan, 0.1))
    assert_array_equal(player[[0, 2]], (0.2, 0.1))
    assert player[1] == desired(0.3)[1]


def test_how_an_episode_ends():
    environment, task, memory = opened("tick", "stairs")
    readings, unit = task.read(environment.physics.data.ptr), task.scene.arena.unit

    def ended(x, y):
        place = np.array([x, memory.ground.center_y + y, 0.0])
        after = task.ground.after(task.context, memory.ground, place, readings, False)
        core = memory.core._replace(place=place)
        return tuple(bool(end) for end in task.ended(memory._replace(core=core, ground=after), readings))

    assert ended(0.0, 0.0) == (False, False)
    assert task.ended(memory._replace(health=memory.health._replace(fell=np.True_)), readings) == (True, False)
    assert ended(0.0, 10.1 * unit) == (False, True)
    assert ended(0.0, -9.9 * unit) == (False, False)
    assert ended((task.scene.arena.length - 0.9) * unit, 0.0) == (False, True)
    assert ended(-3.1 * unit, 0.0) == (False, True)
    deep = readings._replace(foot_heights=np.full(6, 0.1 * unit) - np.eye(6)[2] * 0.2 * unit)
    for steps in range(1, 6):
        memory = task.after(memory, deep)
        assert (memory.ground.steps_under_ground, bool(task.ended(memory, deep)[0])) == (steps, steps == 5)
    assert task.progress(memory)["sank"] == 1.0
    assert task.after(memory, readings).ground.steps_under_ground == 0


def obedient_places(task, count):
    """Places (steps, count, 2) of torsos that move exactly as the schedules of as many episodes say."""
    random, sizes = np.random.RandomState(0), task.context.step_units
    schedules = [task.settings.command.schedule(random, 1.0) for _ in range(count)]
    ends, commands = np.array([drawn.ends for drawn in schedules]), np.array([drawn.schedule for drawn in schedules])
    heading, place, places = random.uniform(-np.pi, np.pi, count), np.zeros((count, 2)), []
    for step in range(STEPS):
        forward, left, turn = (scheduled_value(ends, commands, np.full(count, step)) * sizes).T
        heading_x, heading_y = np.cos(heading), np.sin(heading)
        place = place + np.stack([heading_x * forward - heading_y * left, heading_y * forward + heading_x * left], -1)
        heading = heading + turn
        places.append(place)
    return np.array(places)


@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("settings", [{}, {"curriculum": True}])
def test_no_command_leads_over_the_edge_of_the_ground_of_roam(robot, settings):
    task, _ = prepare_task(robot, "roam", settings)
    task, places = task.unwrapped, obedient_places(task.unwrapped, 500)
    for level in (0, LEVELS - 1) if settings else (0,):
        stream = Stream(level, np.nan, False)
        starts = [task.ground.place(task.context, np.random.RandomState(seed), stream)[1] for seed in range(40)]
        ys = [y for _, y in starts]
        for start in (starts[int(np.argmin(ys))], starts[int(np.argmax(ys))]):
            assert not task.scene.arena.has_left(*(places + start).T).any()


@pytest.mark.parametrize(("robot", "arena"), tiers(itertools.product(ROBOTS, GROUNDS), turns(ROBOTS, GROUNDS)))
def test_no_command_leads_over_the_edge_of_an_arena(robot, arena):
    task, _ = prepare_task(robot, "steer", {"arena": arena})
    assert not task.scene.arena.has_left(*obedient_places(task, 500).T).any()
    way = np.linspace(0.0, STEPS * task.scene.control_timestep * prepare_task(robot, "walk")[0].target_velocity)
    assert not task.scene.arena.has_left(way, np.zeros_like(way)).any()


@pytest.mark.parametrize("task_name", ["walk", "steer", "directed"])
@pytest.mark.parametrize("arena", ["bumps", "rough", "stairs"])
def test_who_gets_to_the_edge_is_truncated_and_has_not_fallen(task_name, arena):
    environment = arc_suite.load("tick", task_name, {"arena": arena, "random": 0})
    environment.reset()
    ground = environment.task.definition.scene.arena
    for direction in ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)):
        environment.reset()
        steps = np.outer(np.arange(0.0, 200.0, 0.5) * ground.unit, direction)
        last = steps[np.argmax(ground.has_left(*steps.T)) - 1]  # half a standing height before the edge counts
        environment.physics.data.qpos[:2] = last + np.multiply(direction, 0.6 * ground.unit)
        timestep = environment.step(np.zeros(18))
        assert timestep.last() and timestep.discount == 1.0


@pytest.mark.parametrize(
    ("robot", "task_name", "settings"),
    [
        ("tick", "roam", {"difficulty": 1.0}),
        ("bastion", "roam", {"difficulty": 1.0}),
        ("leaper", "roam", {"curriculum": True, "level": 9}),
        ("varied:7", "roam", {}),
        ("tick", "steer", {"arena": "bumps"}),
    ],
)
def test_a_start_stands_on_the_ground(robot, task_name, settings):
    environment = arc_suite.load(robot, task_name, {"random": 0, **settings})
    height = environment.task.definition.scene.body.torso.standing_height
    for _ in range(60):
        environment.reset()
        assert min(environment.physics.data.contact.dist, default=0.0) > -0.005 * height


def test_a_start_on_a_steep_plane_stands_on_it():
    """An arena of another package, steeper than the suite's: a ball touches it beside its lowest point."""
    environment = arc_suite.load("tick", "steer", {"arena": Incline(), "random": 0})
    for _ in range(10):
        environment.reset()
        assert min(environment.physics.data.contact.dist, default=0.0) > -0.005 * 0.18


@dataclasses.dataclass(frozen=True)
class Incline(Arena):
    """A plane with a slope of 0.5 rad along x."""

    def add_to(self, root, **contact):
        turn = (np.cos(0.25), 0.0, -np.sin(0.25), 0.0)
        root.worldbody.add("geom", name="floor", type="plane", size=(0, 0, 1), quat=turn, conaffinity=1, **contact)

    def height(self, x, y):
        return x * np.tan(0.5)


def test_distance_is_the_share_of_what_was_asked_for():
    _, task, memory = opened("tick", "stairs", time_limit=10.0)
    step = task.context.units[0] * task.scene.control_timestep
    walked = memory._replace(
        core=memory.core._replace(steps=100), command=memory.command._replace(distance=50.0 * step)
    )
    distance = task.progress(walked)["distance"]
    assert distance == pytest.approx(0.5)
    fell = walked._replace(health=memory.health._replace(fell=np.True_))
    assert task.progress(fell)["distance"] == pytest.approx(0.25), "of 200 steps"
    assert task.stream_state(walked) == Stream(0, distance, False)


@pytest.mark.parametrize(
    ("carry", "stays", "level"),
    [
        (Stream(4, 0.81, False), 0.9, (5, False)),
        (Stream(4, 0.81, True), 0.9, (4, False)),
        (Stream(4, 0.79, False), 0.9, (4, False)),
        (Stream(4, 0.41, True), 0.9, (4, False)),
        (Stream(4, 0.39, False), 0.9, (3, False)),
        (Stream(0, 0.1, True), 0.9, (0, False)),
        (Stream(9, 0.9, False), 0.74, (9, False)),
        (Stream(9, 0.9, False), 0.76, (2, True)),
        (Stream(9, 0.9, True), 0.76, (9, False)),
        (Stream(2, 0.9, False, True), 0.76, (9, False)),
        (Stream(2, 0.1, True, True), 0.76, (9, False)),
        (Stream(9, 0.9, False, True), 0.76, (9, False)),
    ],
)
def test_levels_rise_and_fall_by_what_was_commanded(carry, stays, level):
    assert next_level(carry, stays, 2, down=0.4, up=0.8) == level


def test_a_master_of_all_levels_spends_most_episodes_at_the_highest():
    random, stream, levels = np.random.RandomState(0), Stream(0, np.nan, False), []
    for _ in range(5000):
        level, visits = next_level(stream, random.uniform(), random.randint(LEVELS), down=0.4, up=0.8)
        stream = Stream(level, 1.0, False, visits)
        levels.append(int(level))
    assert np.mean(np.array(levels) == LEVELS - 1) > 0.8
    assert set(levels) == set(range(LEVELS))


def test_levels_of_gaps_differ():
    arena = prepare_task("tick", "gaps", {"curriculum": True})[0].scene.arena
    x = np.arange(terrain.RUNWAY, terrain.RUNWAY + 1.0, 1.0 / 32.0) * arena.unit  # the first trench begins here
    trenches = [(arena.height(x, arena.start(level) + 0.0 * x) < 0.0).mean() for level in range(LEVELS)]
    assert_allclose(trenches, np.arange(1, LEVELS + 1) / 16.0)


@pytest.mark.slow
@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("name", ["rough", "course"])
def test_environments_of_a_curriculum_are_single_environments(name, threads):
    """Over six episodes whose levels change."""
    settings = {"curriculum": True, "level": 4, "time_limit": 0.6}
    envs = VectorEnv("leaper", name, 3, threads, task_kwargs=settings)
    single = gymnasium.make(f"arc_suite/leaper-{name}-v0", task_kwargs=settings)
    assert_array_equal(envs.reset(seed=10)[0][1], single.reset(seed=11)[0])
    random, levels, ended = np.random.RandomState(0), [], False
    for _ in range(80):
        ended = twins.step(envs, single, random.uniform(-1.0, 1.0, 12).astype(np.float32), ended)
        levels.append(single.unwrapped.task.progress["level"])
    assert levels[0] == 4.0 and len(set(levels)) >= 3
    assert_array_equal(envs.reset(seed=10)[0][1], single.reset(seed=11)[0])
    assert_array_equal(envs._memory.ground.level, 4)  # a seed begins a new stream


@pytest.mark.long
def test_a_curriculum_rises_for_who_walks():
    environment, *_ = opened("tick", "stairs", curriculum=True, time_limit=12.0)
    demonstrator, levels = Demonstrator("tick", "surefooted"), []
    for _ in range(3):
        timestep = environment.reset()
        levels.append(environment.task.memory.ground.level)
        while not timestep.last():
            timestep = environment.step(demonstrator(timestep))
    assert levels == [levels[0], levels[0] + 1, levels[0] + 2]


@pytest.mark.release
def test_ground_has_no_scale():
    distances = []
    for scale in (0.075, 1.0, 10.0):
        body = generator.scaled(generator.generate(6, 3), scale)
        envs = VectorEnv(body, "rough", 6, task_kwargs={"terrain_seed": 3})
        *_, (*_, infos) = walked(envs, "surefooted", 250)
        distances.append(infos["progress_distance"].mean())
    assert np.ptp(distances) < 0.02 and min(distances) > 0.8


def test_roaming_follows_commands_from_the_middle_of_the_lane():
    environment, task, memory = opened("tick", "roam")
    task, memory = task.task, memory.task  # without its kicks
    middle = 0.5 * task.scene.arena.length * task.scene.arena.unit
    assert abs(environment.physics.data.qpos[0] - middle) < 0.1 * middle
    assert_array_equal(memory.core.desired, memory.command.schedule[0])
    assert "distance" not in environment.task.progress and "tracking" in environment.task.progress
    walked = memory._replace(core=memory.core._replace(steps=200, all_tracking=np.float64(120.0)))
    assert task.stream_state(walked).outcome == pytest.approx(0.6)
    fell = walked._replace(health=memory.health._replace(fell=np.True_))
    assert task.stream_state(fell).outcome == pytest.approx(0.12)


def test_trenches_and_hurdles_stand_apart():
    arena = prepare_task("queen", "leap", {"width": 0.75, "rise": 0.3})[0].scene.arena
    x = np.arange(0.0, 40.0, 1.0 / 32.0) + 1.0 / 64.0
    for lane, (kind, _) in enumerate(arena.lanes):
        heights = arena.height(x * arena.unit, np.full_like(x, arena.start(lane))) / arena.unit
        edges = x[1:][np.diff(heights != 0.0)]
        height, length = {"trenches": (-0.6, 1.0), "hurdles": (0.4, 0.25)}[kind]
        assert set(heights.round(9)) == {0.0, height}
        np.testing.assert_allclose(np.diff(edges)[::2], length)
        lands = np.diff(edges)[1::2]
        assert 6.9 < lands.min() <= lands.max() < 9.1
