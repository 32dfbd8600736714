"""The base class of modifiers: a modifier is one value with one or several settings that belong together.

A modifier says what an episode draws, which fields of the model change, and what happens to actions, readings and
observations. Its methods are pure functions of arrays with any leading axes, like those of a task. `Modified` calls
the modifiers in their order, from the body outwards. Actions pass in the other direction, from the last to the first.
"""

from collections.abc import Hashable, Iterator, Mapping
from typing import Any, ClassVar, Self

from arc_suite import checks
from arc_suite.markers import Marker
from arc_suite.robots.mirror import Image
from arc_suite.robots.spec import Body
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.modifiers.draws import Episode
from arc_suite.tasks.readings import Readings
from arc_suite.tasks.scene import Inputs, Scene


class Modifier:
    """Base class of modifiers, which are NamedTuples. For a batch of bodies, each field is stacked into one array.

    Write `of`, and the methods for what the modifier does. A state is a NamedTuple of arrays, or an empty tuple.

    Attributes:
        defaults: by name of a setting, the value that changes nothing.
        bounds: by name of a setting, the lowest and highest number; both ends of a range lie between them.
        read_back_fields: fields of the model that `read_back` takes.
    """

    __slots__ = ()

    defaults: ClassVar[Mapping[str, Any]] = {}
    bounds: ClassVar[Mapping[str, tuple[float, float]]] = {}
    read_back_fields: ClassVar[tuple[str, ...]] = ()

    @classmethod
    def of(cls, settings: Mapping[str, Any], body: Body, blocks: Mapping[str, Block]) -> Self:
        """Return the modifier that settings ask for.

        Args:
            settings: the values of the settings of all modifiers, by name.
            body: the body of the task.
            blocks: blocks of the task's observation, by name.

        Raises:
            ValueError: a value that does not fit.
        """
        raise NotImplementedError(f"modifier {cls.__name__}: expected a method of(settings, body, blocks)")

    @classmethod
    def check_number(cls, name: str, settings: Mapping[str, Any]) -> float:
        """Return a setting that is a number within its bounds.

        Raises:
            ValueError: another value.
        """
        return checks.number(name, settings[name], *cls.bounds[name])

    @classmethod
    def check_span(cls, name: str, settings: Mapping[str, Any]) -> tuple[float, float]:
        """Return a setting that is a range, or a number for both of its ends, within its bounds.

        Raises:
            ValueError: another value.
        """
        return checks.span(name, settings[name], *cls.bounds[name])

    @property
    def is_active(self) -> bool:
        """Whether steps have to call it."""
        return True

    @property
    def structure(self) -> Hashable:
        """A value that must be equal for all environments of a batch, in addition to `is_active`."""
        return ()

    def check_mirror(self, image: Image) -> None:
        """Check that the modifier treats both sides of the body alike, on average over episodes.

        Raises:
            ValueError: it treats one side differently.
        """

    def draw(self, episode: Episode) -> Any:
        """Return the state at the start of an episode.

        A modifier of another package draws from `episode.generator(name)`.
        """
        return ()

    def fields(self, scene: Scene, model: Mapping[str, Any], state) -> dict[str, Any]:
        """Return the fields of the model that the episode changes.

        Args:
            scene: scene of the task.
            model: the fields that `scene.CHANGEABLE` names, as the task and the modifiers before this one change them.
            state: the state at the start.
        """
        return {}

    def act(self, state, action, elapsed) -> tuple[Any, Any]:
        """Return the state, and the action (..., joints) for the task or the modifier before this one.

        Args:
            state: the state before the step.
            action: (..., joints) action of the policy, or from the modifier after this one.
            elapsed: (..., 1) uint32, control steps since the start.
        """
        return state, action

    def drive(self, state, inputs: Inputs, elapsed) -> Inputs:
        """Return the inputs of the simulation in a step, given the inputs from the task; for `elapsed` see `act`."""
        return inputs

    def sense(self, state, readings: Readings) -> Readings:
        """Return the readings as sensors show them."""
        return readings

    def measure(self, state, readings: Readings) -> Any:
        """Return the state after the readings of a reset or a step, as sensors show them."""
        return state

    def observe(self, state, observed: dict, elapsed) -> dict:
        """Return the observation's blocks (..., size) by name; for `elapsed` see `act`."""
        return observed

    def remember(self, state, observed: Mapping[str, Any], is_start: bool) -> Any:
        """Return the state after an observation, given its blocks (..., size) by name and whether it is the first."""
        return state

    def blocks(self, body: Body, blocks: Mapping[str, Block]) -> Mapping[str, Block]:
        """Return the blocks of the observation by name, given those of the task and earlier modifiers."""
        return blocks

    def privileged_blocks(self, body: Body) -> dict[str, Block]:
        """Return the privileged blocks that the modifier adds, by name."""
        return {}

    def privileged(self, state, elapsed, heading) -> dict[str, Any]:
        """Return the observation of its privileged blocks, each (..., size), by name.

        Args:
            state: the state after the step.
            elapsed: (..., 1) uint32, control steps since the start.
            heading: (...) heading of the torso, rad.
        """
        return {}

    def read_back(self, scene: Scene, blocks: Mapping[str, Any], fields: Mapping[str, Any]) -> dict[str, Any]:
        """Return those of its privileged blocks, each (size,), whose values a user has changed in the model.

        A privileged observation shows the body as it is, also where a user has changed the model of an environment.

        Args:
            scene: scene of the task.
            blocks: the privileged blocks of one environment as the episode has drawn them, by name.
            fields: fields of the model that a user has set, by name.
        """
        return {}

    def markers(self, scene: Scene, state, readings: Readings, elapsed: int) -> Iterator[Marker]:
        """Yield the markers with which pictures of one environment show the modifier."""
        yield from ()

    def failed_legs(self, scene: Scene, state, elapsed: int) -> tuple[str, ...]:
        """Return the names of the legs whose motors have failed, of one environment."""
        return ()
