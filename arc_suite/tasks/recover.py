"""Recover: getting up from any fall.

An episode starts in one of the poses in which the body came to rest after a drop with limp motors, with any heading.
Half of the episodes start in its mirror image. Rewards do not depend on a body's size.
"""

import functools
import math
from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple

import numpy as np

from arc_suite import checks, rotations
from arc_suite.models.standing import GRAVITY, measure_standing
from arc_suite.robots import mirror
from arc_suite.robots.spec import Body
from arc_suite.simulation import falls
from arc_suite.tasks import blocks, mirrors, modifiers, parameters
from arc_suite.tasks import readings as reading
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.context import force_unit
from arc_suite.tasks.contract import Inputs, Start, Task
from arc_suite.tasks.parts import Vector
from arc_suite.tasks.readings import Readings

LEAST_UPRIGHT = math.cos(math.radians(20.0))  # cosine of the torso's tilt, of a body that is up
LEAST_HEIGHT = 0.8  # of the torso of a body that is up, shares of the height at which it stands
HOLD_TIME = 0.5  # s, without a break, after which a body has got up

# Seeds of the drops from which episodes start: policies are judged by falls that they did not learn from.
_JUDGING_SEED = 0
_LEARNING_SEED = 1

_MEAN_SQUARE_ANGLE = 0.1  # rad^2, deviation from the standing pose at which the bonus is a half
_REST_ENERGY = 0.1  # of motion, in m g h, at which the bonus is a half
_ROUNDING = 1e-6  # control steps
_AXES = ("forward", "left", "up")  # of the torso


class RecoverSettings(NamedTuple):
    """Settings of the task.

    Attributes:
        fall_seed: seed of the drops.
        weights: signed weight of every term.
    """

    fall_seed: int
    weights: dict[str, float]


class RecoverMemory(NamedTuple):
    """Memory of an episode.

    Attributes:
        steps: (...) control steps since the start.
        action: (..., joints) action of the latest step, clipped to [-1, 1].
        previous_action: (..., joints) action of the step before; 0 before the first.
        is_up: (...) whether the torso is upright and high.
        steps_up: (...) control steps for which it has been so without a break.
        got_up: (...) whether it ever was for `HOLD_TIME`.
        seconds: (...) time until it was, or the time so far, s.
    """

    steps: int | np.ndarray
    action: np.ndarray
    previous_action: np.ndarray
    is_up: np.ndarray
    steps_up: int | np.ndarray
    got_up: np.ndarray
    seconds: np.ndarray


class Recover(Task):
    """Getting up from any fall."""

    name = "recover"
    own_arena = True
    demonstrators = ("rising",)
    training = {"fall_seed": _LEARNING_SEED, "time_limit": 10.0}
    # Attributes that follow from the body; see `Task.from_body`.
    from_body = ("clearances", "height", "_force_unit", "hold_steps")
    weights: ClassVar[dict[str, float]] = {
        "upright": 1.0,
        "height": 1.0,
        "up": 1.0,
        "pose": 0.5,
        "rest": 0.5,
        "control": -0.1,
        "smoothness": -0.1,
    }

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """Return the names of the settings."""
        return RecoverSettings._fields

    @classmethod
    def settings_for(cls, body: Body, overrides: Mapping[str, Any]) -> RecoverSettings:
        """Return the settings for a body, some of them overridden."""
        settings_of_all_tasks = ("time_limit", "random", *modifiers.MODIFIERS)
        for name in overrides:
            checks.name(name, cls.names(), f"setting of {cls.name}", suggestions=settings_of_all_tasks)
        fall_seed = checks.integer("fall_seed", overrides.get("fall_seed", _JUDGING_SEED), 0, checks.MAX_SEED)
        return RecoverSettings(fall_seed, parameters.weights(cls.weights, changed=overrides.get("weights")))

    @property
    def lies(self) -> bool:
        """Whether an episode starts with the torso on the ground."""
        return True

    @functools.cached_property
    def blocks(self) -> Mapping[str, Block]:
        """Posture, velocities and contact forces relative to the heading, and the world's up axis for the torso."""
        body = self.scene.body
        vertical = Block((Vector("world's up axis, torso's", axes=_AXES),), 2.0 * blocks.ORIENTATION_NOISE)
        return {
            "posture": blocks.posture(body),
            "velocities": blocks.velocities(body, headed=True),
            "contact_forces": blocks.contact_forces(body, headed=True),
            "vertical": vertical,
        }

    @functools.cached_property
    def height(self) -> float:
        """The height at which the torso stands, m: h, or less if the soles hang less far below it (Leaper: 0.75 h)."""
        pose = measure_standing(self.scene.body)
        return min(pose.height, -float(pose.soles[:, 2].min()))

    @functools.cached_property
    def _force_unit(self) -> np.ndarray:
        return force_unit(self.scene.body)

    @functools.cached_property
    def hold_steps(self) -> int:
        """Control steps without a break after which a body has got up."""
        return math.ceil(HOLD_TIME / self.scene.control_timestep - _ROUNDING)

    @functools.cached_property
    def start_table(self) -> np.ndarray:
        """(falls, nq) poses of a body that has fallen: after the drops, without those in which it is up."""
        poses = falls.drop_body(self.scene.body, self.settings.fall_seed, falls.DROPS)
        poses = reading.torso_qpos(poses, self.scene.layout)
        return poses[~self.stands(poses[:, 2], poses[:, 3:7])]

    def stands(self, torso_height, torso_quaternion):
        """Return whether (...) a torso with a height (...), m, and a quaternion (..., 4) is high and upright."""
        return (torso_height > LEAST_HEIGHT * self.height) & (rotations.upright(torso_quaternion) > LEAST_UPRIGHT)

    @functools.cached_property
    def _mirror(self) -> mirrors.Mirror | None:
        """The mirror map of the joints; None for a body without mirror image."""
        body = self.scene.body
        return mirrors.joints(mirror.image(body)) if mirror.has_image(body) else None

    def start(self, random: np.random.RandomState, stream: Any) -> Start:
        """Draw the start, in this order: pose of the table, heading, whether it is mirrored."""
        pose = self.start_table[random.randint(len(self.start_table))]
        yaw = random.uniform(-math.pi, math.pi)
        is_mirrored = random.randint(2) == 1
        qpos = pose.copy()
        if is_mirrored and self._mirror is not None:
            layout = self.scene.layout
            home = 0.0 if layout.home is None else layout.home
            qpos[3:7] = mirrors.QUATERNION(qpos[3:7])
            qpos[layout.joint_angles] = self._mirror(qpos[layout.joint_angles] - home) + home
        qpos[3:7] = rotations.turn_about_z(qpos[3:7], yaw)
        no_action = np.zeros(len(self.scene.body.joint_names))
        memory = RecoverMemory(
            steps=0,
            action=no_action,
            previous_action=no_action,
            is_up=np.False_,
            steps_up=0,
            got_up=np.False_,
            seconds=np.float64(0.0),
        )
        return Start(qpos, np.zeros(len(self.scene.model["dof_armature"])), memory)

    def read(self, data) -> Readings:
        """Return the readings, with contact forces in the body's weight and relative to the heading."""
        layout = self.scene.layout
        heading = rotations.yaw(data.qpos[..., 3:7])
        forces = reading.headed_forces(data, layout, self._force_unit, heading)
        return reading.read(data, layout, self.scene.arena, forces)

    def begin(self, memory: RecoverMemory, readings: Readings) -> RecoverMemory:
        """Return the memory as it was drawn."""
        return memory

    def before(self, memory: RecoverMemory, action) -> tuple[RecoverMemory, Inputs]:
        """Return the memory with the action, and the action as the input."""
        return memory._replace(action=action, previous_action=memory.action), Inputs(action)

    def after(self, memory: RecoverMemory, readings: Readings) -> RecoverMemory:
        """Return the memory after a control step: whether the body is up, and for how long."""
        timestep = self.scene.control_timestep
        is_up = self.stands(readings.torso_height, readings.torso_quaternion)
        steps_up = (memory.steps_up + 1) * is_up
        return memory._replace(
            steps=memory.steps + 1,
            is_up=is_up,
            steps_up=steps_up,
            got_up=memory.got_up | (steps_up >= self.hold_steps),
            seconds=memory.seconds + timestep * ~memory.got_up,
        )

    def terms(self, memory: RecoverMemory, readings: Readings) -> dict:
        """Return bonuses for a torso upright, high and at rest in the standing pose, and costs of the motors."""
        height = self.height
        velocities = readings.velocities
        upright = 0.5 + 0.5 * rotations.upright(readings.torso_quaternion)
        linear_energy = (velocities[..., :3] ** 2).sum(axis=-1) / (GRAVITY * height)
        angular_energy = (velocities[..., 3:6] ** 2).sum(axis=-1) * (height / GRAVITY)
        joint_energy = (velocities[..., 6:] ** 2).mean(axis=-1) * (height / GRAVITY)
        square_angle = (readings.joint_angles**2).mean(axis=-1)
        efforts = readings.effort(memory.action)
        change = memory.action - memory.previous_action
        return {
            "upright": upright,
            "height": upright * (readings.torso_height / height).clip(0.0, 1.0),
            "up": memory.is_up * 1.0,
            "pose": memory.is_up / (1.0 + square_angle / _MEAN_SQUARE_ANGLE),
            "rest": memory.is_up / (1.0 + (linear_energy + angular_energy + joint_energy) / _REST_ENERGY),
            "control": (efforts**2).mean(axis=-1),
            "smoothness": (change**2).mean(axis=-1),
        }

    def observe(self, memory: RecoverMemory, readings: Readings) -> dict:
        """Return the blocks relative to the heading, and the world's up axis in the torso's frame."""
        heading = rotations.yaw(readings.torso_quaternion)
        observation = {
            **reading.observe_by_heading(readings, heading),
            "contact_forces": readings.contact_forces,
            "vertical": rotations.matrix(readings.torso_quaternion)[..., 2, :],
        }
        return reading.remove_negative_zeros(observation)

    def ended(self, memory: RecoverMemory, readings: Readings) -> tuple:
        """Return that nothing ends an episode but its time."""
        return memory.is_up & False, False

    def progress(self, memory: RecoverMemory) -> dict:
        """Return whether the body got `up`, 0 or 1, and the `time_to_get_up`, s, or the time so far."""
        return {"up": memory.got_up * 1.0, "time_to_get_up": memory.seconds}
