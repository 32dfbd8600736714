"""The contract of a task: frozen values and pure functions of arrays, which every driver can run.

A task says how an episode starts, what it remembers, what a policy observes, what the reward of a step is and
when the episode ends. It holds no state and touches no simulation: memory is an argument and a result, and what
is to be written into the simulation is returned. Arrays may have any leading axes `...`: none for one environment,
one for a batch. Functions of arrays come from the array's own namespace, so that the same text runs under NumPy
and JAX. NumPy rounds powers of scalars and of arrays differently: write `x * x` where `x` has only leading axes.
`arc-suite check --task` finds what differs between one environment and a batch.

An episode, as a driver runs it, for one environment or with a leading axis for a batch::

    start = task.start(random, stream)            # all randomness of the episode
    ... the driver resets the simulation to start.qpos and start.qvel ...
    readings = task.read(data)
    qpos = task.clear_spawn(start.memory, readings)     # if not None: written, and read again
    memory = task.begin(start.memory, readings)
    while not ended:
        memory, inputs = task.before(memory, action)
        ... the driver writes the inputs and runs the simulation for a control step ...
        readings = task.read(data)
        memory = task.after(memory, readings)
        terms, reward = terms.reward(task.terms(memory, readings), task.settings.weights, task.cost_limit)
        blocks = task.observe(memory, readings)
        terminated, truncated = task.ended(memory, readings)
    stream = task.stream_state(memory)
"""

import collections
import dataclasses
import functools
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Mapping, Sequence
from typing import Any, ClassVar, NamedTuple

import numpy as np

from arc_suite.arenas import FLAT, Arena
from arc_suite.markers import Marker
from arc_suite.robots import mirror
from arc_suite.robots.spec import Body
from arc_suite.tasks import mirrors, privileged
from arc_suite.tasks import readings as reading
from arc_suite.tasks.blocks import Block, slices
from arc_suite.tasks.mirrors import Symmetry
from arc_suite.tasks.parameters import Parameters
from arc_suite.tasks.readings import Readings
from arc_suite.tasks.scene import Inputs, Scene, Start

__all__ = [
    "CURRICULUM",
    "LEVEL",
    "STEPS",
    "FileSetting",
    "Inputs",
    "Observed",
    "Readings",
    "Scene",
    "Start",
    "Task",
]

STEPS = 1000  # control steps of an episode

# Settings of a curriculum: whether there is one, and the level at which it begins. Evaluation leaves them out.
CURRICULUM = "curriculum"
LEVEL = "level"

_CLEARANCE = 0.01  # standing heights; feet start at least so far above the ground
_RINGS = (0.35, 0.7, 0.9)  # distances from a foot's center at which the ground is measured, shares of the ball's radius
_DIRECTIONS = 8  # points on each ring
# Points (points, 2) on the rings, forward and left of the foot's center, in radii.
_POINTS_AROUND_FOOT = np.array(
    [
        (distance * math.cos(angle), distance * math.sin(angle))
        for distance in _RINGS
        for angle in np.arange(_DIRECTIONS) * (2.0 * math.pi / _DIRECTIONS)
    ]
)
# Heights (points,) of the center over the lower side of the ball at these points, in radii.
_BALL_HEIGHTS = np.sqrt(1.0 - np.repeat(_RINGS, _DIRECTIONS) ** 2)


class FileSetting(NamedTuple):
    """Functions of a setting whose values may be paths of files. Stored settings hold the content of the files.

    Attributes:
        embed: function from a value to one with the content of files in place of their paths.
        names_file: function from a value to whether it holds the path of a file.
        label: function from a value to one that is short enough for people to read.
    """

    embed: Callable[[Any], Any]
    names_file: Callable[[Any], bool]
    label: Callable[[Any], Any]


class Observed(ABC):
    """Base of `Task` and of `wrapper.Wrapper`: what follows from the blocks of the observation that a task declares.

    A wrapper may change the blocks, so it computes this again and does not take it from the task that it wraps.

    Attributes:
        name: name of the task.
        scene: scene of the task.
    """

    name: ClassVar[str]
    scene: Scene

    @property
    @abstractmethod
    def blocks(self) -> Mapping[str, Block]:
        """The blocks of the observation by name, in the order of the vector."""

    @functools.cached_property
    def sizes(self) -> dict[str, int]:
        """The size of every block of the observation by name, in the order of the vector."""
        return {name: block.size for name, block in self.blocks.items()}

    @functools.cached_property
    def symmetry(self) -> Symmetry:
        """The mirror maps of observations and actions.

        A walk and its mirror image have the same rewards. The image starts from the mirrored state, takes the
        mirrored actions, and walks on mirrored ground. Where left and right legs take turns, the clock of its gait is
        half a cycle later.

        Raises:
            ValueError: the body, the gait or its default angles are not symmetric, or a block has numbers without a
                frame.
        """
        image = mirror.image(self.scene.body)
        for name, block in self.blocks.items():
            if not block.has_frame:
                raise ValueError(f"task {self.name}: block {name!r} has numbers without a frame, so no mirror image")
        observation = mirrors.join(block.mirror(image) for block in self.blocks.values())
        return Symmetry(observation, mirrors.joints(image))

    @functools.cached_property
    def size(self) -> int:
        """The size of the observation as a vector."""
        return sum(self.sizes.values())

    def vector(self, blocks: Mapping[str, np.ndarray], dtype=None) -> np.ndarray:
        """Return observed blocks as one vector (..., size), in new memory.

        Raises:
            ValueError: they are not those that the task declares.
        """
        self._check_sizes(blocks)
        arrays = list(blocks.values())
        return arrays[0].__array_namespace__().concatenate(arrays, axis=-1, dtype=dtype)

    def copy_blocks(self, blocks: Mapping[str, np.ndarray]) -> collections.OrderedDict:
        """Return observed blocks by name, in new memory.

        Raises:
            ValueError: they are not those that the task declares.
        """
        self._check_sizes(blocks)
        return collections.OrderedDict({name: block.copy() for name, block in blocks.items()})

    def _check_sizes(self, blocks: Mapping[str, np.ndarray]) -> None:
        """Raise ValueError for blocks with other names, sizes or order than those that the task declares."""
        if [(name, block.shape[-1]) for name, block in blocks.items()] != self._sizes_in_order:
            sizes = {name: block.shape[-1] for name, block in blocks.items()}
            raise ValueError(f"observation of {self.name}: expected blocks {self.sizes}, got {sizes}")

    def split(self, vector: np.ndarray) -> collections.OrderedDict:
        """Return an observation vector (..., size) as named blocks, views of it.

        Raises:
            ValueError: a vector of another size.
        """
        if vector.shape[-1:] != (self.size,):
            raise ValueError(f"observation: expected {self.size} numbers, got shape {vector.shape}")
        return collections.OrderedDict((name, vector[..., part]) for name, part in self._slices.items())

    @functools.cached_property
    def _sizes_in_order(self) -> list[tuple[str, int]]:
        return list(self.sizes.items())

    @functools.cached_property
    def _slices(self) -> dict[str, slice]:
        """The slice of each block in the vector."""
        return slices(self.sizes)


@dataclasses.dataclass(frozen=True, eq=False)
class Task(Observed):
    """Definition of what a body has to do: a frozen value, checked when it is made.

    Attributes:
        scene: what it is made for.
        settings: its numbers. The field `weights` holds `weights`, with changes of the robot or the caller.
        step_limit: control steps of an episode, may be infinite.
        name: name by which `arc_suite.load` and ids know the task.
        weights: signed weight of every term of the reward by name, in the order of summation.
        cost_limit: bound of the weighted sum of the costs of a step; None for no bound. See `terms.reward`.
        version: increased with any change of dynamics, reward or observation.
        commands: sizes of what may be set from outside while an episode runs, such as by a player's stick,
            by name; see `with_command`.
        own_arena: whether it takes place in an arena of its own, and in no other.
        modifiers: settings of `tasks.modifiers` that the task has unless the caller gives others.
        file_settings: settings whose values may be paths of files, by name.
        training: settings that learners train with unless the caller gives others; policies are judged without them.
        demonstrators: names of presets that suit the task, the best first; empty where this follows from the blocks.
        gait_and_pose: gait and pose by command, see `gait_and_pose.GaitAndPose`; None where there are none.
        from_body: cached attributes with numbers that follow from the body or the settings. Where these and the
            settings are stacked along a leading axis, the functions of the task take a batch of different bodies or
            settings. A subclass declares this attribute again, as it may have further ones. Without it, each body has
            its own batch.
        structure: what else environments of one batch share.
    """

    scene: Scene
    settings: Any
    step_limit: float = STEPS

    name: ClassVar[str]
    weights: ClassVar[Mapping[str, float]]
    cost_limit: ClassVar[float | None] = None
    version: ClassVar[int] = 0
    commands: ClassVar[Mapping[str, int]] = {}
    own_arena: ClassVar[bool] = False
    modifiers: ClassVar[Mapping[str, Any]] = {}
    file_settings: ClassVar[Mapping[str, FileSetting]] = {}
    training: ClassVar[Mapping[str, Any]] = {}
    demonstrators: ClassVar[tuple[str, ...]] = ()
    gait_and_pose: ClassVar[Any] = None
    from_body: ClassVar[tuple[str, ...]] = ()
    structure: ClassVar[Hashable] = ()

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """Return the names of the settings, which errors propose; none if the class does not list them."""
        return ()

    @classmethod
    @abstractmethod
    def settings_for(cls, body: Body, overrides: Mapping[str, Any]) -> Any:
        """Return the settings for a body, some of them overridden.

        Raises:
            ValueError: an unknown name, or a value that does not fit.
        """

    @classmethod
    def arena(cls, body: Body, settings) -> Arena:
        """Return where the task takes place; a caller may choose another arena unless the task has its own."""
        return FLAT

    def phase(self, memory) -> Any:
        """Return the phase (...) of the prescribed gait, rad in [0, 2 pi); None where the task prescribes none."""
        return None

    def leg_phases(self, memory) -> tuple[Any, Any] | None:
        """Return the phase (..., legs) of each leg, rad, and the duty factor (...) of the gait that holds.

        The gait has a leg in stance while its phase, modulo 2 pi, is below 2 pi times the duty factor. The duty factor
        may be one number for all environments. None where the task prescribes no gait.
        """
        phase = self.phase(memory)
        gait = self.parameters
        if phase is None or gait is None:
            return None
        return phase[..., None] + gait.phase_offsets, gait.duty_factor

    @property
    def unwrapped(self) -> "Task":
        """The task itself, without the wrappers around it."""
        return self

    @property
    def reads(self) -> tuple[str, ...]:
        """The names of the fields of `MjData` that `read` takes."""
        layout = self.scene.layout
        if layout.torso_place is not None:
            return reading.FIELDS_OF_PLACED_TORSOS
        return reading.FIELDS if layout.limits is None else reading.FIELDS_OF_SERVOS

    @property
    def actions(self) -> str:
        """What an action means: the "torque" of a motor, or the "position" of a servo."""
        return "position" if self.scene.body.source else "torque"

    @property
    def velocity_ranges(self) -> Sequence[tuple[float, float]] | None:
        """The least and the greatest desired velocity that episodes draw, by direction; None without a command.

        Directions are forward, left and turning, in units of the command.
        """
        return None

    @property
    def command_limits(self) -> Mapping[str, tuple[np.ndarray, np.ndarray]]:
        """The lowest and highest numbers (size,) of the `commands` that are bounded, by name."""
        return {}

    def named_command(self, name: str, value: str) -> np.ndarray | None:
        """Return the numbers (size,) of a live command that is given by a name, such as a gait.

        None for commands that have no names.

        Raises:
            ValueError: there is no such name.
        """
        return None

    @property
    def lies(self) -> bool:
        """Whether an episode starts with the torso on the ground."""
        return False

    @property
    def start_table(self) -> np.ndarray | None:
        """The table (n, ...) from which starts are drawn, whose hash records of results hold; None without one."""
        return None

    @property
    def adapts(self) -> bool:
        """Whether the start of an episode depends on the outcome of the one before, as in a curriculum."""
        return False

    @property
    def parameters(self) -> Parameters | None:
        """The gait and the standing pose that the task prescribes; None where it prescribes none."""
        return None

    @property
    def target_velocity(self) -> float | None:
        """The constant target velocity along world x, m/s; None where it changes or there is none."""
        return None

    def first(self) -> Any:
        """Return the stream state with which a new stream of episodes begins."""
        return None

    @abstractmethod
    def start(self, random: np.random.RandomState, stream: Any) -> Start:
        """Draw how an episode starts, and everything else that is random in it.

        The number of draws is fixed and does not depend on drawn values, so that an episode is a
        function of its seed, the stream state and its actions.

        Args:
            random: the random generator.
            stream: state of the stream after the previous episode, or `first()`.
        """

    def read(self, data) -> Readings:
        """Return the readings of `MjData`, or of an object that has its fields with leading axes."""
        return reading.read(data, self.scene.layout, self.scene.arena)

    def clear_spawn(self, memory, readings: Readings) -> np.ndarray | None:
        """Return the positions (..., nq) at which every foot is clear of the ground at the start of an episode.

        None on level ground, which pushes out feet that start in it. Other ground would hold them.
        """
        return None if self.scene.arena.is_level else self.raise_off_ground(readings)

    def raise_off_ground(self, readings: Readings) -> np.ndarray:
        """Return the positions (..., nq) of the readings, raised until every foot is clear of the ground.

        A foot is a ball that the clearance enlarges. The ground is measured under its center and around it, as a slope
        touches a ball on one side.
        """
        xp = readings.foot_heights.__array_namespace__()
        rise = (self.clearances - readings.foot_heights).max(axis=-1)
        if not self.scene.arena.is_level:
            depths = self._lowest_centers(readings) - readings.foot_positions[..., None, 2]
            rise = xp.maximum(rise, depths.max(axis=(-2, -1)))
        rise = rise.clip(0.0)
        x, y, z = (readings.torso_position[..., axis] for axis in range(3))
        position = xp.stack([x, y, z + rise], axis=-1)
        return xp.concatenate([position, readings.qpos[..., 3:]], axis=-1)

    def _lowest_centers(self, readings: Readings):
        """Return the heights (..., legs, points) of feet, m, at which they touch the ground at points around them."""
        feet = readings.foot_positions
        xp = feet.__array_namespace__()
        radii = xp.asarray(self.clearances)[..., None]
        offsets = radii[..., None] * xp.asarray(_POINTS_AROUND_FOOT)
        ground = self.scene.arena.height(feet[..., None, 0] + offsets[..., 0], feet[..., None, 1] + offsets[..., 1])
        return ground + radii * xp.asarray(_BALL_HEIGHTS)

    @functools.cached_property
    def clearances(self) -> np.ndarray:
        """(legs,) lowest heights over the ground at which the centers of feet start, m."""
        radii = np.array([leg.foot.radius for leg in self.scene.body.legs])
        return radii + _CLEARANCE * self.scene.body.torso.standing_height

    @abstractmethod
    def begin(self, memory, readings: Readings) -> Any:
        """Return the memory from which the first step starts, given the readings after the reset."""

    @abstractmethod
    def before(self, memory, action) -> tuple[Any, Inputs]:
        """Return the memory and what to write before a control step, given the action (..., joints)."""

    @abstractmethod
    def after(self, memory, readings: Readings) -> Any:
        """Return the memory after a control step."""

    def position_center(self, memory) -> Any:
        """Return the angles (..., joints) that positions of actions are relative to, rad from the standing pose.

        None for the standing pose. See `modifiers.Control`.
        """
        return None

    def observed_position_center(self, blocks: Mapping[str, np.ndarray]) -> Any:
        """Return `position_center` given the blocks of the observation, as a demonstrator sees it."""
        return None

    def with_command(self, memory, name: str, value) -> Any:
        """Return the memory with a live command: numbers (..., size) of one of `commands`, set from outside.

        NaN stands for the command of the task itself.
        """
        return memory._replace(**{name: value})

    @abstractmethod
    def terms(self, memory, readings: Readings) -> dict:
        """Return the reward's raw terms by name, each (...), without weights and limits."""

    @abstractmethod
    def observe(self, memory, readings: Readings) -> dict:
        """Return the observation's blocks by name, each (..., size), in the order of `blocks`."""

    @abstractmethod
    def ended(self, memory, readings: Readings) -> tuple:
        """Return whether the episode is terminated and whether it is truncated, (...) booleans each."""

    @property
    def privileged_blocks(self) -> Mapping[str, Block]:
        """The blocks of the privileged observation by name; see `tasks.privileged`."""
        return privileged.blocks(self.scene.body)

    def privileged(self, memory, data) -> dict:
        """Return the privileged observation's blocks, each (..., size), of `MjData` or anything with its fields."""
        return privileged.read_observation(self.scene, data)

    def read_back(self, blocks: Mapping[str, Any], fields: Mapping[str, Any]) -> dict:
        """Return those privileged blocks of one environment, each (size,), that changed fields of the model decide."""
        return {}

    @property
    def read_back_fields(self) -> tuple[str, ...]:
        """The fields of the model that `read_back` takes."""
        return ()

    def progress(self, memory) -> dict:
        """Return how well the episode has gone so far, figures (...) by name; no part of the reward."""
        return {}

    def resampled(self, memory) -> Any:
        """Return whether (...) the latest step began another drawn command, or one boolean for all environments.

        The reward of that step already judges the motion by it. See `VectorEnv.resampled`.
        """
        return False

    def markers(self, memory, readings: Readings) -> list[Marker]:
        """Return the markers of command and kicks in pictures of one environment; no leading axes."""
        return []

    def failed_legs(self, memory) -> tuple[str, ...]:
        """Return the names of the legs whose motors have failed, which pictures show dark, of one environment."""
        return ()

    def stream_state(self, memory) -> Any:
        """Return what the next episode of the stream starts from, given the memory at an episode's end."""
        return None
