"""Tasks in which a body follows a command of velocities, on some ground, in the prescribed gait.

A task is composed of frozen values: a command, a ground, a health, and in some tasks a gait and a pose by
command. This module defines the order in which they draw, remember, observe and earn. Nothing in it has a
scale: lengths are in standing heights h, speeds in the body's own target velocity or sqrt(g h), rates in
sqrt(g / h), contact forces in the body's weight. Directions are the body's own, as the torso heads,
so that an episode may start in any. What standing still would earn is gated by how well the command is followed.
"""

import functools
import math
from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.arenas import Arena
from arc_suite.markers import Marker
from arc_suite.models.standing import GRAVITY
from arc_suite.robots.spec import Body
from arc_suite.tasks import blocks, clock, energy, parameters, terms
from arc_suite.tasks import readings as reading
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.clock import Clock
from arc_suite.tasks.command import Command, Scheduled, WithLive
from arc_suite.tasks.context import Context
from arc_suite.tasks.contract import Inputs, Start, Task
from arc_suite.tasks.gait_and_pose import GaitAndPose, GaitAndPoseMemory
from arc_suite.tasks.ground import Ground, Level
from arc_suite.tasks.health import Condition, Upright
from arc_suite.tasks.parameters import Noise, Parameters
from arc_suite.tasks.parts import Part, Planar, Scalar
from arc_suite.tasks.readings import Readings, component

COST_LIMIT = 0.6  # a third of it is what standing costs, twice as much uniform torques

# Weights of the costs: walk's, of rates in SI units as Queen has them in units of her own.
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

_AHEAD = 0.8  # distance from the torso to where the command's arrows begin, R
_SHAFT = 0.06  # radius of the arrows, R
_SAMPLES = np.linspace(0.0, 1.0, 9)  # of an arrow, which the ground must not cover
_GOING, _TURNING = (1.0, 0.75, 0.1, 1.0), (0.2, 0.8, 1.0, 1.0)  # their colors


class CommandTaskSettings(NamedTuple):
    """Settings of a task with a command.

    Attributes:
        parameters: of the gait, and the target velocity.
        weights: signed weight of every term.
        cost_limit: bound of the costs of a step, whose weights are negative; see `terms.reward`.
        noise: of the start.
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


class Sensed(
    NamedTuple("Sensed", [(field, np.ndarray) for field in (*Readings._fields, "heading", "touches", "feet")])
):
    """Readings with contact forces in the body's weight and as the torso heads.

    Attributes:
        heading: (...) yaw of the torso, rad.
        touches: (...) whether the body touches an obstacle; None where there are none.
        feet: (..., feet, 2) places from the torso's frame, forward and left, m; None where no pose is by command.
    """

    torso_height, effort = Readings.torso_height, Readings.effort


class Core(NamedTuple):
    """Memory that every task with a command has; velocities are (forward, left, turning) in `Context.units`.

    Attributes:
        steps: (...) control steps since the start.
        tick: (...) of the gait's clock, which rests while the command says stop.
        action: (..., joints) of the latest step, clipped to [-1, 1].
        previous_action: (..., joints) of the step before; 0 before the first.
        schedule_errors: (...) number of contact schedule errors in the latest step.
        all_schedule_errors: (...) sum of `schedule_errors` over the steps.
        energy: of the motors.
        path: (...) length of the path of the leaky motion since the start, m.
        place: (..., 3) of the torso's frame at the latest reading: x and y, m, and yaw, rad.
        motion: (..., 3) velocity of the torso, a leaky mean over a cycle of the gait.
        desired: (..., 3) velocity that the command asks for.
        followed: (...) tracking of the latest step.
        tracking: (...) sum of `followed` over the steps.
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
    followed: np.ndarray
    tracking: np.ndarray


class CommandTaskMemory(NamedTuple):
    """Memory of an episode: what all tasks with a command have, and that of each of the values."""

    core: Core
    command: Any
    ground: Any
    health: Condition
    gait_and_pose: GaitAndPoseMemory | None = None


class CommandTask(Task):
    """Following a command.

    Attributes:
        command: what to follow.
        gait_and_pose: which gait and pose to follow, in addition; None for the prescribed gait.
        ground: where, with the settings that a caller does not give.
        health: when a body has fallen.
        yaw: half-width of the heading at the start, rad.
    """

    command: ClassVar[Command]
    gait_and_pose: ClassVar[GaitAndPose | None] = None
    ground: ClassVar[Ground] = Level()
    health: ClassVar[Upright] = Upright()
    weights: ClassVar[Mapping[str, float]] = {
        "progress": 0.5,
        "tracking": 1.5,
        "healthy": 1.0,
        "obedient_gait": 1.5,
        **COSTS,
    }
    yaw: ClassVar[float] = math.pi
    demonstrators: ClassVar[tuple[str, ...]] = ("reactive",)

    def __init_subclass__(cls, **kwargs):
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
        elsewhere = () if cls.own_arena else ("arena",)
        given = parameters.values(body, overrides, cls.name, cls.names(), elsewhere)
        return CommandTaskSettings(
            parameters.parameters(body, given, backward=False),
            parameters.weights(cls.weights, given["weights"], overrides.get("weights")),
            parameters.positive("cost_limit", overrides.get("cost_limit", COST_LIMIT)),
            parameters.noise(given),
            cls.ground.with_settings(overrides),
            cls.command.with_settings(body, overrides),
            cls.gait_and_pose and cls.gait_and_pose.with_settings(body, overrides),
        )

    @classmethod
    def arena(cls, body: Body, settings: CommandTaskSettings) -> Arena:
        """Return the arena of the ground."""
        return settings.ground.arena(body, settings.parameters)

    @functools.cached_property
    def blocks(self) -> Mapping[str, Block]:
        """The paper's observation, the command with the motion that is to follow it, what command and ground add."""
        body, gait, gait_and_pose = self.scene.body, self.parameters, self.settings.gait_and_pose
        return {
            **blocks.of_gait(body, gait.phase_offsets, gait.default_angles, headed=True),
            "command": Block((*_velocity("desired"), *_velocity("measured"))),
            **self.settings.command.blocks(body),
            **({} if gait_and_pose is None else gait_and_pose.blocks(body)),
            **self.settings.ground.blocks,
        }

    @property
    def commands(self) -> Mapping[str, int]:
        """Sizes of what may be set from outside while an episode runs, by name."""
        body, gait_and_pose = self.scene.body, self.settings.gait_and_pose
        return self.settings.command.live(body) | ({} if gait_and_pose is None else gait_and_pose.live(body))

    @property
    def command_limits(self) -> Mapping[str, tuple[np.ndarray, np.ndarray]]:
        """The lowest and highest numbers of the commands that are bounded, by name."""
        gait_and_pose, scene = self.settings.gait_and_pose, self.scene
        return {} if gait_and_pose is None else gait_and_pose.limits(scene.body, scene.control_timestep)

    def named_command(self, name: str, value: str) -> np.ndarray | None:
        """Return the numbers of a command that is given by a name."""
        gait_and_pose = self.settings.gait_and_pose
        return None if gait_and_pose is None else gait_and_pose.named(self.scene.body, name, value)

    @property
    def lies(self) -> bool:
        """Whether an episode starts with the torso on the ground."""
        return self.settings.ground.lies

    @property
    def adapts(self) -> bool:
        """Whether there is a curriculum."""
        return self.settings.ground.adapts

    @functools.cached_property
    def parameters(self) -> Parameters:
        """The prescribed gait."""
        return self.settings.parameters

    @property
    def cost_limit(self) -> float:
        """The bound of the weighted sum of the costs of a step."""
        return self.settings.cost_limit

    @functools.cached_property
    def context(self) -> Context:
        """Lengths and speeds of the body."""
        gait_and_pose = self.settings.gait_and_pose
        reference = None if gait_and_pose is None else gait_and_pose.reference(self.scene, self.parameters)
        return Context.of(self.scene, self.parameters, self.step_limit, reference)

    @functools.cached_property
    def clock(self) -> Clock:
        """The clock of the prescribed gait."""
        p = self.parameters
        return Clock.made(
            p.gait_frequency, p.duty_factor, p.phase_offsets, self.scene.control_timestep, self.step_limit
        )

    def phase(self, memory: CommandTaskMemory):
        """Return the phase (...) of the gait, rad."""
        if self.settings.gait_and_pose is None:
            return self.clock.at(self.clock.phases, memory.core.tick)
        return self.settings.gait_and_pose.phase(memory.gait_and_pose)

    def leg_phases(self, memory: CommandTaskMemory) -> tuple[Any, Any]:
        """Return the phase (..., legs) of each leg, rad, and the duty factor (...) of the gait that holds."""
        if self.settings.gait_and_pose is None:
            return super().leg_phases(memory)
        return self.settings.gait_and_pose.leg_phases(memory.gait_and_pose)

    def first(self) -> Any:
        """Return the ground's stream state."""
        return self.settings.ground.first()

    def start(self, random: np.random.RandomState, stream: Any) -> Start:
        """Draw the start, in this order: ground, state, yaw, schedule, obstacles, command, gait and pose.

        The schedule is drawn for every command, and used by `command.Schedule` alone.

        Raises:
            ValueError: the memory of a command that can be set live has no field `live`.
        """
        context, ground = self.context, self.settings.ground
        ground_memory, displacement = ground.place(context, random, stream)
        qpos, qvel = self.settings.noise.drawn(ground.pose(self.scene), random)
        qpos[:2] += displacement
        qpos[3:7] = rotations.turn_about_z(qpos[3:7], random.uniform(-self.yaw, self.yaw))
        schedule = self.settings.command.schedule(random, ground.share(ground_memory))
        ground_memory, obstacles = ground.obstacles(context, random, ground_memory)
        command_memory = self._start_command(random, schedule)
        gait_and_pose = self.settings.gait_and_pose
        gait_memory = None if gait_and_pose is None else gait_and_pose.start(context, random)
        still, zero = np.zeros(len(self.scene.body.joint_names)), np.float64(0.0)
        spent, none = energy.start(len(still)), np.zeros(3)
        core = Core(0, 0, still, still, zero, zero, spent, zero, none, none, none, zero, zero)
        health = self.health.start(lies=ground.lies)
        memory = CommandTaskMemory(core, command_memory, ground_memory, health, gait_memory)
        return Start(qpos, qvel, memory, obstacles)

    def _start_command(self, random: np.random.RandomState, schedule: Scheduled) -> Any:
        command = self.settings.command
        memory = command.start(self.context, random, schedule)
        if command.live(self.scene.body) and not isinstance(memory, WithLive):
            kind = type(command).__name__
            raise ValueError(f"command {kind}: expected a memory with a field 'live', or no live commands, got neither")
        return memory

    def read(self, data) -> Sensed:
        """Take the readings."""
        layout, heading = self.scene.layout, rotations.yaw(data.qpos[..., 3:7])
        forces = data.cfrc_ext[..., layout.parts, :] / self.context.force_unit
        numpy, across = forces.__array_namespace__(), heading[..., None]
        torque = rotations.to_heading_frame(forces[..., 0:2], across)
        force = rotations.to_heading_frame(forces[..., 3:5], across)
        forces = numpy.concatenate([torque, forces[..., 2:3], force, forces[..., 5:6]], axis=-1)
        readings = reading.read(data, layout, self.scene.arena, forces)
        touches = self.settings.ground.touches(data)
        if self.settings.gait_and_pose is None:
            return Sensed(*readings, heading, touches, None)
        apart = data.xpos[..., layout.feet, :2] - data.xpos[..., layout.torso, None, :2]
        return Sensed(*readings, heading, touches, rotations.to_heading_frame(apart, across))

    def clear_spawn(self, memory: CommandTaskMemory, readings: Sensed) -> np.ndarray:
        """Return the qpos (..., nq) that brings every foot clear of the ground, level ground too."""
        return self.cleared(readings)

    def begin(self, memory: CommandTaskMemory, readings: Sensed) -> CommandTaskMemory:
        """Remember where the torso is, and what the command asks for there."""
        place = _place(readings)
        command = self.settings.command.begin(self.context, memory.command, place)
        desired = self.settings.command.desired(self.context, command, memory.core.steps, place)
        spent = energy.begin(memory.core.energy, readings.joint_angles)
        core = memory.core._replace(energy=spent, place=place, desired=desired)
        return memory._replace(core=core, command=command)

    def before(self, memory: CommandTaskMemory, action) -> tuple[CommandTaskMemory, Inputs]:
        """Remember the action, which is applied as it is."""
        core = memory.core._replace(action=action, previous_action=memory.core.action)
        return memory._replace(core=core), Inputs(action)

    def after(self, memory: CommandTaskMemory, readings: Sensed) -> CommandTaskMemory:
        """Return the memory after a control step, in this order: gait, health, motion, command, ground."""
        core, context, place = memory.core, self.context, _place(readings)
        numpy, steps = place.__array_namespace__(), core.steps + 1
        going = core.desired.any(axis=-1)
        tick = core.tick + going
        gait_and_pose, gait_memory = self.settings.gait_and_pose, memory.gait_and_pose
        if gait_and_pose is None:
            stance, crouch = self.clock.at(self.clock.stance, tick), 1.0
        else:
            gait_memory = gait_and_pose.before_feet(context, gait_memory, steps, going)
            stance, crouch = gait_and_pose.stance(gait_memory), gait_and_pose.crouch(gait_memory)
        stance = stance | ~going[..., None]  # all feet, while the command says stop
        schedule_errors = clock.schedule_errors(readings.foot_heights, self.parameters.stance_threshold, stance)
        health = self.health.after(context, memory.health, readings, steps, crouch)
        motion = self._motion(core, place)
        if gait_and_pose is not None:
            stepped = 1.0 - schedule_errors / self.parameters.feet
            gait_memory = gait_and_pose.after(context, gait_memory, readings, stepped)
        followed = self.settings.command.follow(context, memory.command, steps, core.place, place, motion, readings)
        ground = self.settings.ground.after(context, memory.ground, place, readings, followed.arrived)
        core = Core(
            steps=steps,
            tick=tick,
            action=core.action,
            previous_action=core.previous_action,
            schedule_errors=schedule_errors,
            all_schedule_errors=core.all_schedule_errors + schedule_errors,
            energy=energy.after(core.energy, self._torques, readings.effort(core.action), readings.joint_angles),
            path=core.path + context.pace * numpy.hypot(motion[..., 0], motion[..., 1]),
            place=place,
            motion=motion,
            desired=followed.desired,
            followed=followed.tracking,
            tracking=core.tracking + followed.tracking,
        )
        return CommandTaskMemory(core, followed.memory, ground, health, gait_memory)

    @functools.cached_property
    def _torques(self) -> np.ndarray:
        return energy.torques(self.scene.body)

    def _motion(self, core: Core, place):
        """The mean velocity (..., 3), of steps in the frame of the heading at their start."""
        context, numpy, moved = self.context, place.__array_namespace__(), place - core.place
        turn = rotations.wrap_angle(moved[..., 2])
        moved = numpy.concatenate(
            [rotations.to_heading_frame(moved[..., :2], core.place[..., 2]), turn[..., None]], axis=-1
        )
        return (1.0 - context.leaks) * core.motion + context.leaks * moved / context.step_units

    def with_command(self, memory: CommandTaskMemory, name: str, value) -> CommandTaskMemory:
        """Return the memory with a live command."""
        if name not in self.settings.command.live(self.scene.body):
            gait_memory = self.settings.gait_and_pose.with_command(memory.gait_and_pose, name, value)
            return memory._replace(gait_and_pose=gait_memory)
        command = memory.command._replace(live=value)
        desired = self.settings.command.desired(self.context, command, memory.core.steps, memory.core.place)
        return memory._replace(core=memory.core._replace(desired=desired), command=command)

    def terms(self, memory: CommandTaskMemory, readings: Sensed) -> dict:
        """Return the paper's costs without scale, and bonuses for following the command.

        `transport` is the cost of transport of a step at the target velocity; its weight is 0.
        """
        core, height, gait_and_pose = memory.core, self.context.height, self.settings.gait_and_pose
        default, stepped = self.parameters.default_angles, 1.0 - core.schedule_errors / self.parameters.feet
        earned = self.settings.command.terms(memory.command, core.followed, memory.health.upright, stepped)
        if gait_and_pose is not None:
            default = gait_and_pose.default_angles(self.context, memory.gait_and_pose, default)
            earned = gait_and_pose.terms(memory.gait_and_pose, earned, core.followed)
        costs = terms.costs(readings, core.action, core.previous_action, core.schedule_errors, default)
        return {
            **costs,
            "angular_velocity": costs["angular_velocity"] * (height / GRAVITY),
            "vertical_velocity": costs["vertical_velocity"] / (GRAVITY * height),
            "transport": core.energy.step / self.context.pace,
            **self.health.terms(memory.health),
            **earned,
        }

    def observe(self, memory: CommandTaskMemory, readings: Sensed) -> dict:
        """Return the blocks as the torso heads, without a clock at a stop and without negative zeros."""
        core, context, heading = memory.core, self.context, readings.heading
        numpy, posture, velocities = core.motion.__array_namespace__(), readings.posture, readings.velocities
        quaternion = rotations.turn_about_z(readings.torso_quaternion, -heading)
        velocity = rotations.to_heading_frame(velocities[..., :2], heading)
        gait_and_pose = self.settings.gait_and_pose
        if gait_and_pose is None:
            circle, more = self.clock.at(self.clock.circle, core.tick), {}
        else:
            circle = gait_and_pose.circle(memory.gait_and_pose)
            more = gait_and_pose.observe(context, memory.gait_and_pose)
        observed = {
            "posture": numpy.concatenate([posture[..., :1], quaternion, posture[..., 5:]], axis=-1),
            "velocities": numpy.concatenate([velocity, velocities[..., 2:]], axis=-1),
            "contact_forces": readings.contact_forces,
            "gait_clock": circle * core.desired.any(axis=-1)[..., None],
            "command": numpy.concatenate([core.desired, core.motion], axis=-1),
            **self.settings.command.observe(context, memory.command),
            **more,
            **self.settings.ground.observe(context, memory.ground, core.place, readings),
        }
        return {name: block + 0.0 for name, block in observed.items()}

    def ended(self, memory: CommandTaskMemory, readings: Sensed) -> tuple:
        """Terminate where the body fell; the ground may end the episode, too."""
        return self.settings.ground.ended(memory.ground, memory.health.fell)

    def progress(self, memory: CommandTaskMemory) -> dict:
        """Return the mean `tracking`, whether the body `fell`, `gait_compliance`, and what command and ground add.

        The cost of transport divides by the path of the leaky motion, whatever its direction.
        """
        core, gait_and_pose, judged = memory.core, self.settings.gait_and_pose, self.judged(memory)
        steps = core.steps + (core.steps == 0)
        return {
            **self.settings.command.progress(self.context, memory.command, judged),
            **({} if gait_and_pose is None else gait_and_pose.progress(memory.gait_and_pose, judged)),
            "tracking": core.tracking / steps,
            **self.health.progress(memory.health),
            "gait_compliance": clock.compliance(core.all_schedule_errors, steps, self.parameters.feet),
            "cost_of_transport": energy.cost_of_transport(core.energy, core.path, self.context.pace * steps),
            **self.settings.ground.progress(memory.ground),
        }

    def resampled(self, memory: CommandTaskMemory) -> Any:
        """Return whether the latest step began another drawn command."""
        steps, gait_and_pose = memory.core.steps, self.settings.gait_and_pose
        velocity = self.settings.command.resampled(memory.command, steps)
        return velocity if gait_and_pose is None else velocity | gait_and_pose.resampled(memory.gait_and_pose, steps)

    def judged(self, memory: CommandTaskMemory):
        """Return the steps (...) over which an episode is judged: a full episode once it is over, else those so far."""
        steps, (terminated, truncated) = memory.core.steps, self.ended(memory, None)
        numpy = memory.core.place.__array_namespace__()
        return numpy.where(terminated | truncated, self.context.steps, steps + (steps == 0))

    def stream_state(self, memory: CommandTaskMemory) -> Any:
        """Return the stream state of the ground, by the outcome of the episode.

        One that was cut off within the first cycle of the gait has none.
        """
        steps, (terminated, truncated) = memory.core.steps, self.ended(memory, None)
        ended = terminated or truncated or steps >= self.step_limit
        if not (ended or steps * self.context.leak >= 1.0):
            return self.settings.ground.stream_state(memory.ground, np.nan, False)
        outcome = self.settings.command.outcome(self.context, memory.command, memory.core.tracking, self.judged(memory))
        return self.settings.ground.stream_state(memory.ground, outcome, memory.health.fell)

    def markers(self, memory: CommandTaskMemory, readings: Sensed) -> list[Marker]:
        """Return arrows on the ground ahead of the torso: the desired velocity, and from its tip the turning.

        The latter is the sideways velocity of a point R ahead. At the target velocity an arrow is R long.
        """
        unit, (x, y, heading) = self.context.reach, memory.core.place
        forward, left, turn = (unit * share for share in memory.core.desired)
        ahead = np.array((math.cos(heading), math.sin(heading)))
        aside = np.array((-ahead[1], ahead[0]))
        hub = np.array((x, y)) + _AHEAD * unit * ahead
        tip = hub + forward * ahead + left * aside
        ways = (hub, tip, _GOING), (tip, tip + turn * aside, _TURNING)
        arrows = [self._arrow(foot, end, color) for foot, end, color in ways if (foot != end).any()]
        base = np.array((*hub, self.scene.arena.height(*hub)))
        disk = Marker("cylinder", base, base + (0.0, 0.0, _SHAFT * unit), 2.0 * _SHAFT * unit, _GOING)
        return [disk, *arrows, *self.settings.command.markers(self.context, memory.command)]

    def _arrow(self, foot: np.ndarray, end: np.ndarray, color) -> Marker:
        """An arrow on the ground between two points (2,); its axis clears what is higher than both ends."""
        points = foot + _SAMPLES[:, None] * (end - foot)
        heights = self.scene.arena.height(*points.T)
        straight = heights[0] + _SAMPLES * (heights[-1] - heights[0])
        lifted = straight + (heights - straight).max() + _SHAFT * self.context.reach
        start, tip = (np.array((*points[i], lifted[i])) for i in (0, -1))
        return Marker("arrow", start, tip, _SHAFT * self.context.reach, color)


def _velocity(name: str) -> tuple[Part, ...]:
    """Return the parts of a velocity (3,) in units of the command."""
    planar = Planar(unit="v*", axes=(f"{name} forward", f"{name} left"))
    return planar, Scalar(f"{name} turning", "v* / R", sign=-1)


def _place(readings: Sensed):
    numpy, frame = readings.posture.__array_namespace__(), readings.frame_position
    return numpy.stack([component(frame, 0), component(frame, 1), readings.heading], axis=-1)
