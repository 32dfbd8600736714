"""Demonstrators: policies that walk by a law, each a preset by name for any body."""

import math
import warnings
from collections.abc import Mapping, Sequence
from typing import NamedTuple, Self

import numpy as np

from arc_suite import checks, robots, rotations
from arc_suite.cpg.balancing import BALANCES, Balance, Balanced
from arc_suite.cpg.law import Ahead, Pattern, felt, joint_targets, torques
from arc_suite.cpg.planner import PLANS, Plan, Planned
from arc_suite.cpg.presets import TUNINGS, ByRank, Preset
from arc_suite.cpg.sighted import TREADS, Sighted, Tread
from arc_suite.cpg.steering import STEERING, Manner, Steered
from arc_suite.cpg.stride import Stride
from arc_suite.models.sizing import control_timestep
from arc_suite.models.soundness import flaws
from arc_suite.robots import ROBOTS, gaits
from arc_suite.robots.spec import Body
from arc_suite.tasks.contract import Task
from arc_suite.tasks.fitting import fitted_gait

# Speeds of bodies that have no presets of their own, as shares of sqrt(g h).
FROUDES = {"slow": 0.18, "medium": 0.25, "fast": 0.32}

# Presets that follow the command of a task; what is sighted needs to see the ground, and balanced is Leaper's alone.
MANNERS = (*STEERING, "sighted", "balanced")

# Who gets on in a task with a command, the best first (docs/ground.md, docs/navigate.md), where that is not `steered`.
_SUITED = {
    **dict.fromkeys(("rough", "slopes", "stairs", "course", "roam"), ("balanced", "surefooted")),
    "gaps": ("sighted",),
    "navigate": ("planned",),
}

# The law of each kind of preset that goes by what a task says; all others go by a clock of their own.
LAWS = {Manner: Steered, Tread: Sighted, Balance: Balanced, Plan: Planned}


class Demonstrator:
    """A policy that walks one body by a preset, in one environment or in the rows of a batch.

    The presets slow, medium, fast, tuned and refined walk straight by a clock of their own, and take
    joint angles and velocities and the torso's orientation alone from the observation. Those of
    `MANNERS` follow the command that they observe, by the gait's clock, and planned one of its own. All
    act in the rows of a batch by `begin` and `act`, as every policy does, and in one environment as a
    function of a `TimeStep` with named blocks, whose first of an episode restarts the demonstrator.

    An observation tells little of whose it is: one of another number of joints or rigid bodies is
    refused, and one whose episode starts at less than half or more than twice the height at which the
    body stands is warned of, since a task may start so. Another robot of as many parts and about the
    same height cannot be told from the body, and walks badly.
    """

    def __init__(self, robot: str | Body, preset: str | Preset = "medium", froude: float | None = None, gait=None):
        """Fit a demonstrator to a body.

        Args:
            robot: queen, bastion, tick or leaper, or any body.
            preset: slow, medium or fast; for the four robots also tuned, which earns most of what
                the paper's law can earn in walk, and refined, which earns most of all, or numbers of
                your own; steered, surefooted or sighted, and for leaper balanced, which follow the command of
                a task; planned, which finds its way among the pillars of a task.
            froude: wanted speed as a share of sqrt(g h), h being the standing height, in place of
                a preset; negative ones walk backwards. Not for the four robots, which have presets
                alone.
            gait: a name of `gaits.NAMES` or a `Gait`; None for that of the robot or body, and for
                presets that go by the task's.

        Raises:
            ValueError: an unknown name, or a value out of range, or a body that cannot walk whatever
                it does, as its feet hang far above the floor; one line that names it and the nearest
                valid one.
        """
        body = robot if isinstance(robot, Body) else ROBOTS[checks.name(robot, ROBOTS, "robot")]
        if isinstance(gait, str):
            gait = gaits.gait(body, gait)
        if not isinstance(preset, Preset):
            presets = presets_of(body)
            preset = presets[checks.name(preset, presets, "preset")]
        # The numbers of a preset of its own were found for a body, whatever it looks like.
        hopeless = [] if isinstance(preset, Preset) else [flaw.text for flaw in flaws(body) if flaw.hopeless]
        if hopeless:
            raise ValueError(f"{body.name} cannot walk: {hopeless[0]}")
        self._body, self._started = body, []
        if isinstance(preset, float):
            speed = preset if froude is None else froude
            self._law = OnClock(body, Stride.fit(body, speed, gait or fitted_gait(body)))
        elif froude is not None:
            raise ValueError(f"froude: {body.name} has presets alone: {', '.join(presets_of(body))}")
        elif isinstance(preset, Preset):
            self._law = OnClock(body, Prescribed.fit(body, preset, gait))
        elif gait is not None:
            raise ValueError("gait: expected none, as the preset walks in the gait of the task")
        else:
            self._law = LAWS[type(preset)](body, preset)

    def begin(self, rows: Sequence[int], seeds: Sequence[int] = ()) -> None:
        """Start episodes in some rows, given by their indices; seeds make no difference."""
        self._law.begin(rows)
        self._started = list(rows)

    def act(self, observation: Mapping[str, np.ndarray], rewards=None) -> np.ndarray:
        """Return the actions of a control step.

        Args:
            observation: blocks by name, each (..., size); leading axes stay from call to call.
            rewards: make no difference.

        Returns:
            (..., joints) in [-1, 1].

        Raises:
            ValueError: not named blocks, those of another body, or none that the preset needs; one line.
        """
        actions = self._law.act(observation)
        if self._started:
            self._look_at_start(observation)
        return actions

    def __call__(self, timestep) -> np.ndarray:
        """Return the action (joints,) of a dm_env `TimeStep` with named blocks."""
        if timestep.first():
            self.begin([0])
        observation = timestep.observation
        if isinstance(observation, Mapping):
            observation = {name: np.asarray(block)[None] for name, block in observation.items()}
        return self.act(observation)[0]

    def _look_at_start(self, observation: Mapping[str, np.ndarray]) -> None:
        """Warn of starts that look like those of another body."""
        heights = np.atleast_2d(observation["posture"])[self._started, ..., 0]
        name, stands, self._started = self._body.name, self._body.torso.standing_height, []
        if ((heights < 0.5 * stands) | (heights > 2.0 * stands)).any():
            text = f"{name} stands {stands:g} m high, and the torso starts below half or above twice that"
            warnings.warn(f"{text}: is this the demonstrator of another robot?", stacklevel=3)


class OnClock:
    """Control by a clock alone, one for each row."""

    def __init__(self, body: Body, control: "Stride | Prescribed"):
        """Take the control of a body."""
        self._control, self._size = control, (len(body.joint_names), len(body.part_names))
        self._clock = np.array(0)

    def begin(self, rows: Sequence[int]) -> None:
        """Restart the clock of some rows."""
        if self._clock.ndim == 0:
            self._clock = np.array(0)
        else:
            self._clock[rows] = 0

    def act(self, observation: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return the actions (rows, joints), or (joints,) alone; see `Demonstrator.act`."""
        quaternion, angles, velocities = felt(observation, *self._size)
        if self._clock.shape != angles.shape[:-1]:
            self._clock = np.broadcast_to(self._clock, angles.shape[:-1]).copy()
        action = self._control(self._clock, quaternion, angles, velocities)
        self._clock = self._clock + 1
        return action


def presets_of(body: Body) -> Mapping[str, Preset | float | Manner | Balance | Tread | Plan]:
    """Return a body's presets by name: of a robot its numbers, of any other its speed as a share of sqrt(g h).

    Those that follow a command are the same for all but robots with numbers of their own.

    Raises:
        ValueError: a body of a robot's name that has other joints; one line.
    """
    own = robots.row(TUNINGS, body, "presets") or FROUDES
    sighted, balance = robots.row(TREADS, body, "presets") or Tread(), robots.row(BALANCES, body, "presets")
    return {**own, **STEERING, "sighted": sighted, **PLANS, **({"balanced": balance} if balance else {})}


def first_preset(body: Body, *names: str) -> str:
    """Return the first of some presets that a body has; every body has `medium`.

    Raises:
        ValueError: as `presets_of`.
    """
    presets = presets_of(body)
    return next(name for name in names if name in presets)


def suited_preset(task: Task) -> str:
    """Return the preset that suits a task, and the body that does it, to watch or to imitate.

    Raises:
        ValueError: as `presets_of`.
    """
    commanded = _SUITED.get(task.name, ("steered",))
    return first_preset(task.scene.body, *(commanded if "command" in task.blocks else ("refined", "tuned", "medium")))


class Prescribed(NamedTuple):
    """Control by a preset's numbers: of one simulation, or with leading axes (rows, 1) of a batch.

    Attributes:
        pattern: of the joints.
        ahead: what is added to the PD loop's actions; None for nothing.
        crouch: (joints,) angles held while settling, rad.
        control_timestep: s.
        stiffness, damping, settle, ramp, ramp_start: as in `Preset`.
    """

    pattern: Pattern
    ahead: Ahead | None
    crouch: np.ndarray
    control_timestep: float | np.ndarray
    stiffness: float | np.ndarray
    damping: float | np.ndarray
    settle: int | np.ndarray
    ramp: float | np.ndarray
    ramp_start: float | np.ndarray

    @classmethod
    def fit(cls, body: Body, preset: Preset, gait: gaits.Gait | None = None) -> Self:
        """Return a preset, laid out over a body's joints, in its own gait or another."""
        if gait is not None:
            preset = preset._replace(phase_offsets=gait.offsets, duty_factor=gait.duty_factor)
        laid = pattern(body, preset)
        crouch = pattern(body, preset._replace(centre=preset.crouch)).centre if preset.crouch else laid.centre
        numbers = (getattr(preset, name) for name in cls._fields[4:])
        return cls(laid, ahead(body, preset), crouch, control_timestep(body), *numbers)

    @classmethod
    def stacked(cls, controls: Sequence[Self]) -> Self:
        """Return several controls of one body as one, of a batch that has a row for each."""

        def stack(values):
            return np.stack([np.atleast_1d(value) for value in values])

        patterns, aheads, *numbers = zip(*controls, strict=True)
        if any(ahead is not None for ahead in aheads):
            none = Ahead(*(np.zeros_like(field) for field in next(filter(None, aheads))))
            added = Ahead(*map(stack, zip(*(ahead or none for ahead in aheads), strict=True)))
        else:
            added = None
        return cls(Pattern(*map(stack, zip(*patterns, strict=True))), added, *map(stack, numbers))

    def __call__(self, clock, quaternion, angles, velocities) -> np.ndarray:
        """Return the actions (..., joints) after `clock` (...) control steps; few presets feel more than the joints."""
        steps = clock[..., None]
        time = (self.control_timestep * steps)[..., 0]
        walking = joint_targets(self.pattern, time)
        targets = np.where(steps < self.settle, self.crouch, walking)
        ramp = (self.ramp_start + (1.0 - self.ramp_start) * steps / self.ramp).clip(max=1.0)
        added = 0.0 if self.ahead is None else self.ahead(self.pattern, time, rotations.yaw(np.asarray(quaternion)))
        return torques(targets, angles, velocities, ramp * self.stiffness, self.damping, added)


def pattern(body: Body, preset: Preset) -> Pattern:
    """Return a preset, laid out over a body's joints.

    Raises:
        ValueError: it does not fit the body; one line.
    """
    return _laid_out(_pattern, body, preset)


def ahead(body: Body, preset: Preset) -> Ahead | None:
    """Return what a preset adds to the PD loop's actions, laid out over a body's joints; None for nothing.

    Raises:
        ValueError: it does not fit the body; one line.
    """
    return _laid_out(_ahead, body, preset)


def _laid_out(function, body: Body, preset: Preset):
    legs, offsets = len(body.legs), len(preset.phase_offsets)
    if legs != offsets:
        raise ValueError(f"preset: {body.name} has {legs} legs, and phase_offsets is for {offsets}")
    try:
        return function(body, preset)
    except (AttributeError, LookupError, TypeError, ValueError) as error:
        raise ValueError(f"preset: does not fit {body.name}: {type(error).__name__}: {error}") from None


def _pattern(body: Body, preset: Preset) -> Pattern:
    def by_rank(angle: ByRank, rank: int) -> float:
        return math.radians(angle[rank] if isinstance(angle, tuple) else angle)

    rows = []
    for leg, rank, offset in zip(body.legs, body.ranks, preset.phase_offsets, strict=True):
        forwards = -1.0 if leg.side == "left" else 1.0
        for joint in leg.joints:
            if joint.name == "hip":
                angles = (preset.sweep, preset.centre.get("hip", 0.0))
                rows.append((offset, *(forwards * by_rank(angle, rank) for angle in angles), 0.0, 0.0))
            else:
                bend = preset.bends[joint.name]
                angles = (preset.centre[joint.name], bend.stance, bend.swing)
                rows.append((offset, 0.0, *(by_rank(angle, rank) for angle in angles)))
    return Pattern(preset.frequency, preset.duty_factor, *np.array(rows).T)


def _ahead(body: Body, preset: Preset) -> Ahead | None:
    if preset.torques is None and not preset.steering:
        return None
    amplitudes, steering = [], []
    for leg, rank in zip(body.legs, body.ranks, strict=True):
        for joint in leg.joints:
            hip = joint.name == "hip"
            sign = -1.0 if hip and leg.side == "left" else 1.0
            amplitudes.append(sign * np.array(preset.torques[joint.name][rank]) if preset.torques else (0.0, 0.0))
            steering.append(preset.steering if hip else 0.0)
    return Ahead(*np.split(np.array(amplitudes), 2, axis=-1), np.array(steering))
