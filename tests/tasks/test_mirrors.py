"""Walks in a mirror: from mirrored starts, by mirrored actions, they are mirrored to rounding."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from refusals import refused
from tiers import tiers, turns

import arc_suite
from arc_suite.bodies import generator
from arc_suite.robots import ROBOTS, mirror
from arc_suite.tasks import TASKS, mirrors
from arc_suite.tasks.modifiers import Kicks, Motors, Pushes
from arc_suite.tasks.sensors import RAYS, SCAN

STEPS = 20
BODIES = [*ROBOTS, *(generator.random_body(seed) for seed in (1, 4, 5, 6, 7, 8)), generator.generate(8, 2)]


def name_of(body):
    return body if isinstance(body, str) else body.name


def look_into_the_mirror(task):
    """Let a task start mirrored, with the clock of its gait half a cycle later where its sides take turns."""
    image, action = mirror.image(task.scene.body), task.symmetry.action
    sign = task.blocks["gait_clock"].mirror(image).signs[0]
    poses = mirrors.join([mirrors.POLAR, mirrors.QUATERNION, action])
    velocities = mirrors.join([mirrors.POLAR, mirrors.AXIAL, action])
    start, clock = task.start, task.clock

    def mirrored(random, stream):
        begun = start(random, stream)
        memory = begun.memory
        if "schedule" in getattr(memory, "command", memory)._fields:
            schedule = memory.command.schedule * (1, -1, -1)
            memory = memory._replace(command=memory.command._replace(schedule=schedule))
        qpos = poses(begun.qpos)
        if "center_y" in getattr(memory, "ground", memory)._fields:
            qpos[1] += 2.0 * memory.ground.center_y  # a lane is mirrored about its middle
        return begun._replace(qpos=qpos, qvel=velocities(begun.qvel), memory=memory)

    vars(task)["start"] = mirrored
    vars(task)["clock"] = clock._replace(circle=sign * clock.circle, stance=clock.stance[:, image.legs])
    vars(task).pop("_gait", None)  # it keeps the clock with which it was made


@pytest.mark.slow
@pytest.mark.parametrize(
    ("body", "task"),
    [
        *((body, task) for task in ("walk", "steer") for body in BODIES),
        # Of steps, which are the same left and right; the triangles of a height field are not.
        *(("queen", task) for task in ("stairs", "gaps")),
    ],
    ids=name_of,
)
def test_a_mirrored_walk_is_a_walk_in_the_mirror(body, task):
    one, other = (arc_suite.load(body, task, {"random": 0}) for _ in range(2))
    definition = one.task.definition
    (observation, action), privileged = definition.symmetry, mirror_of_hidden(definition)
    look_into_the_mirror(other.task.definition)
    random = np.random.RandomState(1)
    timestep, image = one.reset(), other.reset()
    for _ in range(STEPS):
        np.testing.assert_allclose(
            definition.vector(image.observation), observation(definition.vector(timestep.observation)), atol=2e-12
        )
        np.testing.assert_allclose(hidden(other), privileged(hidden(one)), atol=2e-12)
        acts = random.uniform(-0.15, 0.15, action.signs.shape)  # stronger ones throw bodies with sized motors
        timestep, image = one.step(acts), other.step(action(acts))
        assert image.reward == pytest.approx(timestep.reward, abs=1e-12)
        assert not timestep.last()
    # The walk is none that is its own image.
    last = definition.vector(timestep.observation)
    moving = definition.sizes["posture"] + definition.sizes["velocities"]
    assert (abs(observation(last) - last) > 1e-6)[:moving].mean() > 0.7


def hidden(environment):
    """The privileged observation of an environment as one vector."""
    return np.concatenate(list(environment.task.privileged.values()))


def mirror_of_hidden(task):
    """The mirror map of privileged observations."""
    image = mirror.image(task.scene.body)
    return mirrors.join(block.mirror(image) for block in task.privileged_blocks.values())


DRAWN = {"payload": (0.1, 0.4), "center_of_mass": 0.1, "joint_offset": 0.05, "joint_strength": (0.5, 1.0)}
DRAWN |= {
    "gains": (0.8, 1.2),
    "actions": "position",
    "kicks": 0.3,
    "force": 0.3,
    "actuator_failure": True,
    "history": 2,
}


def test_what_modifiers_draw_has_a_mirror_image():
    """A walk with mirrored loads, sensors, motors, kicks and forces is mirrored, and so is what critics see of it."""
    one, other = (arc_suite.load("tick", "walk", {"random": 29, **DRAWN}) for _ in range(2))
    task, image = other.task.definition, mirror.image(ROBOTS["tick"])
    look_into_the_mirror(task.task)
    kinds, start, drawn_alike = task.privileged_blocks, task.start, np.array((1, -1))

    def mirrored(random, stream):
        begun = start(random, stream)
        model, states = {}, []
        for change, state in zip(task.changes, begun.memory.changes.states, strict=True):
            if state != ():
                names = kinds.keys() & state._fields
                state = state._replace(**{name: kinds[name].mirror(image)(getattr(state, name)) for name in names})
            if isinstance(change, Motors):
                state = state._replace(
                    joint_strength=state.joint_strength[image.joints], failing=state.failing[image.joints]
                )
            if isinstance(change, Kicks):
                state = state._replace(kicks=state.kicks * drawn_alike)
            if isinstance(change, Pushes):
                state = state._replace(forces=state.forces * drawn_alike)
            model |= change.fields(task.scene, {**task.scene.model, **model}, state)
            states.append(state)
        changes = begun.memory.changes._replace(states=tuple(states))
        return begun._replace(memory=begun.memory._replace(changes=changes), model=model)

    vars(task)["start"] = mirrored
    (observation, action), privileged = one.task.definition.symmetry, mirror_of_hidden(task)
    timestep, seen, random, pushed = one.reset(), other.reset(), np.random.RandomState(1), 0
    for _ in range(60):
        expected = observation(one.task.definition.vector(timestep.observation))
        np.testing.assert_allclose(task.vector(seen.observation), expected, atol=1e-8)
        np.testing.assert_allclose(hidden(other), privileged(hidden(one)), atol=1e-8)
        acts = random.uniform(-0.1, 0.1, 18)
        timestep, seen = one.step(acts), other.step(action(acts))
        pushed += one.task.privileged["kick"].any() + one.task.privileged["force"].any()
    assert pushed >= 2


@pytest.mark.parametrize("task", ["walk", "steer"])
def test_the_gaits_of_the_robots_take_turns(task):
    for robot in ROBOTS:
        clock = arc_suite.load(robot, task).task.definition.blocks["gait_clock"]
        assert clock.mirror(mirror.image(ROBOTS[robot])).signs.tolist() == [-1, -1]


def test_twice_is_once_for_environments_of_any_precision():
    observation, action = arc_suite.symmetry("leaper", "steer")
    random = np.random.default_rng(0)
    for there, size in ((observation, 169), (action, 12)):
        for precision in (np.float32, np.float64):
            vectors = random.normal(size=(3, 4, size)).astype(precision)
            assert there(vectors).dtype == precision
            assert_array_equal(there(there(vectors)), vectors)
            assert not np.array_equal(there(vectors), vectors)


def test_a_gait_whose_sides_move_together_keeps_its_clock():
    task = arc_suite.load("leaper", "walk", {"gait": "bound"}).task.definition
    assert task.blocks["gait_clock"].mirror(mirror.image(task.scene.body)).signs.tolist() == [1, 1]


@pytest.mark.parametrize(
    ("body", "settings", "message"),
    [
        ("queen", {"phase_offsets": (0, 1, 2, 3, 4, 5)}, "phase_offsets: expected legs across from each other to move"),
        ("queen", {"default_angles": np.arange(18) / 9}, "default_angles: expected mirrored poses left and right"),
        ("queen", {"actuator_failure": 1}, "actuator_failure: expected a leg that is drawn, or one on the midline"),
        (generator.random_body(0), {}, "phase_offsets: expected legs across from each other"),
        (generator.random_body(10), {}, "random_10 is not left-right symmetric: no leg is across from leg1"),
    ],
)
def test_what_has_no_mirror_image_is_refused_in_one_line(body, settings, message):
    with refused(message, begins=True):
        arc_suite.symmetry(body, "walk", settings)


def test_a_task_that_does_not_tell_is_refused():
    import gaitless

    message = "^task stay: block 'velocities' has numbers without a frame, so no mirror image$"
    with gaitless.registered(), pytest.raises(ValueError, match=message):
        arc_suite.symmetry("tick", "stay")


@pytest.mark.parametrize(("robot", "task"), tiers(arc_suite.ALL_TASKS, turns(ROBOTS, TASKS)))
def test_every_task_has_a_mirror(robot, task):
    observation, _ = arc_suite.symmetry(robot, task)
    size = arc_suite.load(robot, task).task.definition.size
    assert_array_equal(np.sort(observation.sources), np.arange(size))


@pytest.mark.parametrize(("task", "block", "points"), [("rough", "scan", SCAN), ("navigate", "ranges", RAYS)])
def test_what_is_seen_at_points_is_seen_on_the_other_side(task, block, points):
    mirrored = arc_suite.load("queen", task).task.definition.blocks[block].mirror(mirror.image(ROBOTS["queen"]))
    np.testing.assert_allclose(mirrored(points), points * [[1.0], [-1.0]], atol=1e-15)


def test_modifiers_leave_a_task_its_mirror_image():
    plain = arc_suite.symmetry("tick", "steer")
    modified = arc_suite.symmetry("tick", "steer", {"actuator_failure": True, "kicks": 1.0, "actions": "position"})
    for mine, other in zip(modified, plain, strict=True):
        assert_array_equal(mine.sources, other.sources)
        assert_array_equal(mine.signs, other.signs)
    blind = arc_suite.symmetry("tick", "steer", {"exclude_blocks": "contact_forces"})
    assert len(blind.observation.sources) == len(plain.observation.sources) - 150
