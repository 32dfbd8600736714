"""Tasks in which a body follows a command of velocities, on some ground, in the prescribed gait.

A task is composed of frozen values: a command, a ground, a `Health` that says when a body has fallen, and in some tasks
a gait and a pose by command. This module defines the order in which they draw, remember, observe and are rewarded.

Observations and rewards do not depend on a body's size: lengths are in standing heights h, speeds in the target
velocity or sqrt(g h), rates in sqrt(g / h), contact forces in the body's weight. Directions are relative to the heading
of the torso, so that an episode may start with any heading. Bonuses that standing still would have are multiplied by
the tracking of the command.
"""

import functools
import math
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.arenas import Arena
from arc_suite.markers import Marker
from arc_suite.models.standing import GRAVITY
from arc_suite.robots.spec import Body
from arc_suite.tasks import blocks, clock, energy, parameters, terms
from arc_suite.tasks import readings as reading
from arc_suite.tasks.arrows import draw_velocity
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.command import Command, Scheduled, WithLive
from arc_suite.tasks.context import Context
from arc_suite.tasks.contract import Inputs, Start
from arc_suite.tasks.gait_and_pose import GaitAndPose, GaitAndPoseMemory
from arc_suite.tasks.gait_task import GaitTask
from arc_suite.tasks.ground import Ground, Level
from arc_suite.tasks.health import Condition, Upright
from arc_suite.tasks.parameters import Noise, Parameters
from arc_suite.tasks.parts import Part, Planar, Scalar
from arc_suite.tasks.prescribed_gait import PrescribedGait
from arc_suite.tasks.readings import Readings, component

COST_LIMIT = 0.6  # standing costs a third of it, uniform random torques twice as much

# Weights of the costs. They are those of walk, converted to units of the body's size with the robot Queen.
COSTS = {
    "gait_cost": -0.1,
    "control": -0.05,
    "smoothness": -0.02,
    "contact": -0.0005,
    "angular_velocity": -0.654,
    "vertical_velocity": -0.147,
    "posture": -0.001,
    "transport": 0.0,
}


class CommandTaskSettings(NamedTuple):
    """Settings of a task with a command.

    Attributes:
        parameters: parameters of the gait, and the target velocity.
        weights: signed weight of every term.
        cost_limit: bound of the costs of a step, whose weights are negative; see `terms.reward`.
        noise: noise of the start.
        ground: the ground with its own settings.
        command: the command with its own settings.
        gait_and_pose: the gait and pose by command with its own settings; None where the task prescribes them.
    """

    parameters: Parameters
    weights: dict[str, float]
    cost_limit: float
    noise: Noise
    ground: Ground
    command: Command
    gait_and_pose: GaitAndPose | None = None


# A NamedTuple cannot inherit from another one, so this one takes the fields of `Readings`, and two of its methods.
class Sensed(
    NamedTuple("Sensed", [(field, np.ndarray) for field in (*Readings._fields, "heading", "touches", "feet")])
):
    """Readings with contact forces in the body's weight, and relative to the heading of the torso.

    Attributes:
        heading: (...) yaw of the torso, rad.
        touches: (...) whether the body touches an obstacle; None where there are none.
        feet: (..., feet, 2) places from the torso's frame, forward and left, m; None in tasks without a commanded pose.
    """

    torso_height = Readings.torso_height
    effort = Readings.effort


class Core(NamedTuple):
    """Memory that every task with a command has; velocities are (forward, left, turning) in `Context.units`.

    Attributes:
        steps: (...) control steps since the start.
        tick: (...) tick of the gait's clock, which stands still while the command is a stop.
        action: (..., joints) action of the latest step, clipped to [-1, 1].
        previous_action: (..., joints) action of the step before; 0 before the first.
        schedule_errors: (...) number of contact schedule errors in the latest step.
        all_schedule_errors: (...) sum of `schedule_errors` over the steps.
        energy: the motors' work by weight, m, from which the cost of transport follows.
        path: (...) length of the path since the start, from `motion`, m.
        place: (..., 3) place of the torso's frame at the latest reading: x and y, m, and yaw, rad.
        motion: (..., 3) velocity of the torso, a leaky mean over a cycle of the gait.
        desired: (..., 3) velocity that the command asks for.
        step_tracking: (...) tracking of the latest step.
        all_tracking: (...) sum of `step_tracking` over the steps.
    """

    steps: int | np.ndarray
    tick: int | np.ndarray
    action: np.ndarray
    previous_action: np.ndarray
    schedule_errors: np.ndarray
    all_schedule_errors: np.ndarray
    energy: energy.Energy
    path: np.ndarray
    place: np.ndarray
    motion: np.ndarray
    desired: np.ndarray
    step_tracking: np.ndarray
    all_tracking: np.ndarray


class CommandTaskMemory(NamedTuple):
    """Memory of an episode: `core`, which all tasks with a command have, and the memory of each value of the task."""

    core: Core
    command: Any
    ground: Any
    health: Condition
    gait_and_pose: GaitAndPoseMemory | None = None


class CommandTask(GaitTask):
    """Following a command.

    Attributes:
        command: command to follow.
        gait_and_pose: gait and pose to follow, in addition to the velocity; None for the prescribed gait.
        ground: ground of the task, with its default settings.
        health: criterion of a fall.
        yaw: half-width of the heading at the start, rad.
    """

    command: ClassVar[Command]
    gait_and_pose: ClassVar[GaitAndPose | None] = None
    ground: ClassVar[Ground] = Level()
    health: ClassVar[Upright] = Upright()
    weights: ClassVar[dict[str, float]] = {
        "progress": 0.5,
        "tracking": 1.5,
        "healthy": 1.0,
        "obedient_gait": 1.5,
        **COSTS,
    }
    yaw: ClassVar[float] = math.pi
    demonstrators: ClassVar[tuple[str, ...]] = ("steered",)

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        cls.own_arena = cls.ground.own_arena

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """Return the names of the settings."""
        gait_and_pose = () if cls.gait_and_pose is None else cls.gait_and_pose.settings
        return (*cls.ground.settings, *cls.command.settings, *gait_and_pose, *parameters.NAMES, "cost_limit")

    @classmethod
    def settings_for(cls, body: Body, overrides: Mapping[str, Any]) -> CommandTaskSettings:
        """Return the settings for a body, some of them overridden; see `parameters.values`."""
        # `arena` is a setting of tasks without an arena of their own, which is read elsewhere; an error may propose it.
        names_of_others = () if cls.own_arena else ("arena",)
        values = parameters.values(body, overrides, cls.name, cls.names(), names_of_others)
        gait_and_pose = None
        if cls.gait_and_pose is not None:
            gait_and_pose = cls.gait_and_pose.with_settings(body, overrides)
        return CommandTaskSettings(
            parameters=parameters.parameters(body, values, backward=False),  # a target velocity above 0 alone
            weights=parameters.weights(cls.weights, values["weights"], overrides.get("weights")),
            cost_limit=parameters.positive("cost_limit", overrides.get("cost_limit", COST_LIMIT)),
            noise=parameters.noise(values),
            ground=cls.ground.with_settings(overrides),
            command=cls.command.with_settings(body, overrides),
            gait_and_pose=gait_and_pose,
        )

    @classmethod
    def arena(cls, body: Body, settings: CommandTaskSettings) -> Arena:
        """Return the arena of the ground."""
        return settings.ground.arena(body, settings.parameters)

    @functools.cached_property
    def blocks(self) -> dict[str, Block]:
        """The paper's observation, the command and the measured motion, and the blocks that command and ground add."""
        body = self.scene.body
        gait = self.parameters
        desired = _velocity("desired")
        measured = _velocity("measured")
        sensed = (True,) * len(desired) + (False,) * len(measured)
        return {
            **blocks.of_gait(body, gait.phase_offsets, gait.default_angles, headed=True),
            "command": Block((*desired, *measured), sensed=sensed),
            **self.settings.command.blocks(body),
            **self._gait.blocks(body),
            **self.settings.ground.blocks,
        }

    @functools.cached_property
    def _gait(self) -> Any:
        """The gait that feet are to follow: a `GaitAndPose` by command, or else the `PrescribedGait`."""
        gait_and_pose = self.settings.gait_and_pose
        return PrescribedGait(self.parameters, self.clock) if gait_and_pose is None else gait_and_pose

    @property
    def commands(self) -> Mapping[str, int]:
        """Sizes of what may be set from outside while an episode runs, by name."""
        body = self.scene.body
        return self.settings.command.live(body) | self._gait.live(body)

    @property
    def velocity_ranges(self) -> Sequence[tuple[float, float]]:
        """The least and the greatest desired velocity that episodes draw, in units of the command."""
        return self.settings.command.velocity_ranges

    @property
    def command_limits(self) -> Mapping[str, tuple[np.ndarray, np.ndarray]]:
        """The lowest and highest numbers of the commands that are bounded, by name."""
        return self._gait.limits(self.scene.body, self.scene.control_timestep)

    def named_command(self, name: str, value: str) -> np.ndarray | None:
        """Return the numbers of a command that is given by a name."""
        return self._gait.named_command(self.scene.body, name, value)

    @property
    def lies(self) -> bool:
        """Whether an episode starts with the torso on the ground."""
        return self.settings.ground.lies

    @property
    def adapts(self) -> bool:
        """Whether there is a curriculum."""
        return self.settings.ground.adapts

    @property
    def cost_limit(self) -> float:
        """The bound of the weighted sum of the costs of a step."""
        return self.settings.cost_limit

    @functools.cached_property
    def context(self) -> Context:
        """Lengths and speeds of the body."""
        reference = self._gait.reference(self.scene, self.parameters)
        return Context.of(self.scene, self.parameters, self.step_limit, reference)

    def phase(self, memory: CommandTaskMemory):
        """Return the phase (...) of the gait, rad."""
        return self._gait.phase(memory.core.tick, memory.gait_and_pose)

    def leg_phases(self, memory: CommandTaskMemory) -> tuple[Any, Any]:
        """Return the phase (..., legs) of each leg, rad, and the duty factor (...) of the present gait."""
        return self._gait.leg_phases(memory.core.tick, memory.gait_and_pose)

    def first(self) -> Any:
        """Return the stream state with which a new stream of episodes begins; the ground alone has one."""
        return self.settings.ground.first()

    def start(self, random: np.random.RandomState, stream: Any) -> Start:
        """Draw the start, in this order: ground, state, yaw, schedule, obstacles, command, gait and pose.

        A schedule is drawn for every command, although `command.Schedule` alone uses it.

        Raises:
            ValueError: the memory of a command that can be set live has no field `live`.
        """
        context = self.context
        ground = self.settings.ground
        ground_memory, displacement = ground.place(context, random, stream)
        qpos, qvel = self.settings.noise.draw(ground.pose(self.scene), random)
        qpos[:2] += displacement
        qpos[3:7] = rotations.turn_about_z(qpos[3:7], random.uniform(-self.yaw, self.yaw))
        widening = ground.share(ground_memory)  # share, from 0 to 1, by which a curriculum has widened the commands
        schedule = self.settings.command.schedule(random, widening)
        ground_memory, obstacles = ground.obstacles(context, random, ground_memory)
        command_memory = self._start_command(random, schedule)
        gait_memory = self._gait.start(context, random)
        joints = len(self.scene.body.joint_names)
        no_action = np.zeros(joints)
        zero = np.float64(0.0)
        core = Core(
            steps=0,
            tick=0,
            action=no_action,
            previous_action=no_action,
            schedule_errors=zero,
            all_schedule_errors=zero,
            energy=energy.start(joints),
            path=zero,
            place=np.zeros(3),
            motion=np.zeros(3),
            desired=np.zeros(3),
            step_tracking=zero,
            all_tracking=zero,
        )
        health = self.health.start(lies=ground.lies)
        memory = CommandTaskMemory(core, command_memory, ground_memory, health, gait_memory)
        return Start(qpos, qvel, memory, obstacles)

    def _start_command(self, random: np.random.RandomState, schedule: Scheduled) -> Any:
        command = self.settings.command
        memory = command.start(self.context, random, schedule)
        # `WithLive` is the protocol of memories with a field `live`.
        if command.live(self.scene.body) and not isinstance(memory, WithLive):
            kind = type(command).__name__
            raise ValueError(f"command {kind}: expected a memory with a field 'live', or no live commands, got neither")
        return memory

    def read(self, data) -> Sensed:
        """Take the readings."""
        layout = self.scene.layout
        heading = rotations.yaw(data.qpos[..., 3:7])
        forces = reading.headed_forces(data, layout, self.context.force_unit, heading)
        readings = reading.read(data, layout, self.scene.arena, forces)
        touches = self.settings.ground.touches(data)
        feet = None
        if self._gait.needs_feet:
            from_torso = data.xpos[..., layout.feet, :2] - readings.frame_position[..., None, :2]
            feet = rotations.to_heading_frame(from_torso, heading[..., None])
        return Sensed(*readings, heading, touches, feet)

    def clear_spawn(self, memory: CommandTaskMemory, readings: Sensed) -> np.ndarray:
        """Return the qpos (..., nq) that brings every foot clear of the ground.

        `Task` leaves bodies on level ground as they start; here they are raised, too.
        """
        return self.raise_off_ground(readings)

    def begin(self, memory: CommandTaskMemory, readings: Sensed) -> CommandTaskMemory:
        """Return the memory with the torso's place after the reset, and the velocity that is desired there."""
        place = _read_place(readings)
        command = self.settings.command.begin(self.context, memory.command, place)
        desired = self.settings.command.desired(self.context, command, memory.core.steps, place)
        energy_memory = energy.begin(memory.core.energy, readings.joint_angles)
        core = memory.core._replace(energy=energy_memory, place=place, desired=desired)
        return memory._replace(core=core, command=command)

    def before(self, memory: CommandTaskMemory, action) -> tuple[CommandTaskMemory, Inputs]:
        """Return the memory with the action, and the action itself as what to write."""
        core = memory.core._replace(action=action, previous_action=memory.core.action)
        return memory._replace(core=core), Inputs(action)

    def after(self, memory: CommandTaskMemory, readings: Sensed) -> CommandTaskMemory:
        """Return the memory after a control step, in this order: gait, health, motion, command, ground."""
        core = memory.core
        context = self.context
        place = _read_place(readings)
        xp = place.__array_namespace__()
        steps = core.steps + 1
        is_going = core.desired.any(axis=-1)  # by the velocity that was desired during the step
        tick = core.tick + is_going
        # A commanded gait advances first, as the contacts of this step are judged by it.
        gait = self._gait
        gait_memory = gait.advance(context, memory.gait_and_pose, steps, is_going)
        stance = gait.stance(tick, gait_memory) | ~is_going[..., None]  # at a stop, all feet stand
        schedule_errors = clock.schedule_errors(readings.foot_heights, self.parameters.stance_threshold, stance)
        height_share = gait.height_share(gait_memory)  # of the standing height, that the command asks for
        health = self.health.after(context, memory.health, readings, steps, height_share)
        motion = self._mean_motion(core, place)
        gait_memory = gait.after(context, gait_memory, readings, schedule_errors)
        followed = self.settings.command.follow(context, memory.command, steps, core.place, place, motion, readings)
        ground = self.settings.ground.after(context, memory.ground, place, readings, followed.arrived)
        core = Core(
            steps=steps,
            tick=tick,
            action=core.action,
            previous_action=core.previous_action,
            schedule_errors=schedule_errors,
            all_schedule_errors=core.all_schedule_errors + schedule_errors,
            energy=self.add_work(core.energy, core.action, readings),
            path=core.path + context.pace * xp.hypot(motion[..., 0], motion[..., 1]),
            place=place,
            motion=motion,
            desired=followed.desired,
            step_tracking=followed.tracking,
            all_tracking=core.all_tracking + followed.tracking,
        )
        return CommandTaskMemory(core, followed.memory, ground, health, gait_memory)

    def _mean_motion(self, core: Core, place):
        """Return the mean velocity (..., 3); that of a step is relative to the heading at its start."""
        context = self.context
        xp = place.__array_namespace__()
        world_displacement = place - core.place
        displacement = rotations.to_heading_frame(world_displacement[..., :2], core.place[..., 2])
        turn = rotations.wrap_angle(world_displacement[..., 2])
        step_motion = xp.concatenate([displacement, turn[..., None]], axis=-1)
        leaks = context.leaks  # (3,) shares of the mean that a step replaces
        # The division by the units of the command comes last: the order decides the last bits.
        return (1.0 - leaks) * core.motion + leaks * step_motion / context.step_units

    def with_command(self, memory: CommandTaskMemory, name: str, value) -> CommandTaskMemory:
        """Return the memory with a live command."""
        gait = self._gait
        if name in gait.live(self.scene.body):
            return memory._replace(gait_and_pose=gait.with_command(memory.gait_and_pose, name, value))
        command = memory.command._replace(live=value)
        desired = self.settings.command.desired(self.context, command, memory.core.steps, memory.core.place)
        return memory._replace(core=memory.core._replace(desired=desired), command=command)

    def terms(self, memory: CommandTaskMemory, readings: Sensed) -> dict:
        """Return the paper's costs, made independent of the body's size, and bonuses for following the command.

        `transport` is the cost of transport of a step at the target velocity; its weight is 0.
        """
        core = memory.core
        height = self.context.height
        gait = self._gait
        feet_in_schedule = clock.compliance(core.schedule_errors, 1, self.parameters.feet)
        bonuses = self.settings.command.terms(
            memory.command, core.step_tracking, memory.health.upright, feet_in_schedule
        )
        bonuses = gait.terms(memory.gait_and_pose, bonuses, core.step_tracking)
        default_angles = gait.default_angles(self.context, memory.gait_and_pose, self.parameters.default_angles)
        costs = terms.costs(readings, core.action, core.previous_action, core.schedule_errors, default_angles)
        return {
            **costs,
            "angular_velocity": costs["angular_velocity"] * (height / GRAVITY),
            "vertical_velocity": costs["vertical_velocity"] / (GRAVITY * height),
            "transport": core.energy.step / self.context.pace,
            **self.health.terms(memory.health),
            **bonuses,
        }

    def observe(self, memory: CommandTaskMemory, readings: Sensed) -> dict:
        """Return the blocks relative to the heading, with a clock of zeros at a stop, and without negative zeros."""
        core = memory.core
        context = self.context
        xp = core.motion.__array_namespace__()
        gait = self._gait
        is_going = core.desired.any(axis=-1)[..., None]
        observation = {
            **reading.observe_by_heading(readings, readings.heading),
            "contact_forces": readings.contact_forces,
            "gait_clock": gait.circle(core.tick, memory.gait_and_pose) * is_going,
            "command": xp.concatenate([core.desired, core.motion], axis=-1),
            **self.settings.command.observe(context, memory.command),
            **gait.observe(context, memory.gait_and_pose),
            **self.settings.ground.observe(context, memory.ground, core.place, readings),
        }
        return reading.remove_negative_zeros(observation)

    def ended(self, memory: CommandTaskMemory, readings: Sensed) -> tuple:
        """Return whether the body fell, which terminates the episode; the ground may end it, and its edge truncates."""
        terminated, truncated = self.settings.ground.ended(memory.ground, memory.health.fell)
        place = memory.core.place
        return terminated, truncated | self.scene.arena.has_left(place[..., 0], place[..., 1])

    def progress(self, memory: CommandTaskMemory) -> dict:
        """Return the mean `tracking`, whether the body `fell`, `gait_compliance`, and what command and ground add.

        The cost of transport divides by the length of the path, whatever its direction.
        """
        core = memory.core
        judged_steps = self.judged_steps(memory)
        steps = core.steps + (core.steps == 0)  # at least 1
        target_path = self.context.pace * steps  # m, that the body would have gone at the target velocity
        return {
            **self.settings.command.progress(self.context, memory.command, judged_steps),
            **self._gait.progress(memory.gait_and_pose, judged_steps),
            "tracking": core.all_tracking / steps,
            **self.health.progress(memory.health),
            "gait_compliance": clock.compliance(core.all_schedule_errors, steps, self.parameters.feet),
            "cost_of_transport": energy.cost_of_transport(core.energy, core.path, target_path),
            **self.settings.ground.progress(memory.ground),
        }

    def resampled(self, memory: CommandTaskMemory) -> Any:
        """Return whether the latest step began another drawn command."""
        steps = memory.core.steps
        is_resampled = self.settings.command.resampled(memory.command, steps)
        return is_resampled | self._gait.resampled(memory.gait_and_pose, steps)

    def judged_steps(self, memory: CommandTaskMemory):
        """Return the steps (...) over which an episode is judged: those so far, or of a full one once it ended."""
        steps = memory.core.steps
        terminated, truncated = self.ended(memory, None)  # the memory decides, readings are not used
        xp = memory.core.place.__array_namespace__()
        steps_so_far = steps + (steps == 0)  # at least 1
        return xp.where(terminated | truncated, self.context.steps, steps_so_far)

    def stream_state(self, memory: CommandTaskMemory) -> Any:
        """Return the stream state of the ground, by the outcome of the episode.

        An episode that was cut off within the first cycle of the gait has no outcome, NaN.
        """
        steps = memory.core.steps
        terminated, truncated = self.ended(memory, None)
        has_ended = terminated or truncated or steps >= self.step_limit  # drivers, not `ended`, apply the limit
        has_full_cycle = steps * self.context.leak >= 1.0  # the leak is the share of a cycle in a step
        if not has_ended and not has_full_cycle:
            return self.settings.ground.stream_state(memory.ground, outcome=np.nan, fell=False)
        outcome = self.settings.command.outcome(
            self.context, memory.command, memory.core.all_tracking, self.judged_steps(memory)
        )
        return self.settings.ground.stream_state(memory.ground, outcome, memory.health.fell)

    def markers(self, memory: CommandTaskMemory, readings: Sensed) -> list[Marker]:
        """Return arrows of the desired velocity, and what the command shows in addition."""
        core = memory.core
        arrows = draw_velocity(self.scene.arena, self.context.reach, core.place, core.desired)
        return [*arrows, *self.settings.command.markers(self.context, memory.command)]


def _velocity(name: str) -> tuple[Part, ...]:
    """Return the parts of a velocity (3,) in units of the command."""
    planar = Planar(unit="v*", axes=(f"{name} forward", f"{name} left"))
    turning = Scalar(f"{name} turning", "v* / R", sign=-1)  # a mirror image turns to the other side
    return planar, turning


def _read_place(readings: Sensed):
    """Return the place (..., 3) of the torso's frame: x and y, m, and yaw, rad."""
    xp = readings.posture.__array_namespace__()
    frame = readings.frame_position
    return xp.stack([component(frame, 0), component(frame, 1), readings.heading], axis=-1)
