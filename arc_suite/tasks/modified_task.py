"""Tasks with modifiers: any task with disturbances, or with other motors or sensors.

A modified task wraps another task, which may come from another package, and calls its modifiers in their order. Its
memory holds the memory of the wrapped task.
"""

import dataclasses
import functools
from collections.abc import Hashable, Mapping
from typing import Any, NamedTuple, TypeVar

import numpy as np

from arc_suite import rotations
from arc_suite.markers import Marker
from arc_suite.robots import mirror
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.contract import Inputs, Start, Task
from arc_suite.tasks.mirrors import Symmetry
from arc_suite.tasks.modifiers import Control, History, Modifier, fit_modifiers
from arc_suite.tasks.modifiers.draws import draw_episode
from arc_suite.tasks.readings import Readings
from arc_suite.tasks.wrapper import Wrapper

_ModifierClass = TypeVar("_ModifierClass", bound=Modifier)


class Changes(NamedTuple):
    """Memory of the modifiers.

    Attributes:
        elapsed: (..., 1) uint32, control steps since the start.
        terminated: (...) whether the latest step has ended the episode in failure.
        states: the state of each modifier, in their order.
    """

    elapsed: np.ndarray
    terminated: np.ndarray
    states: tuple[Any, ...]


class ModifiedMemory(NamedTuple):
    """Memory of a modified task.

    Attributes:
        task: memory of the wrapped task.
        changes: memory of the modifiers.
    """

    task: Any
    changes: Changes


def add_modifiers(task: Task, settings: Mapping[str, Any]) -> Task:
    """Return a task with modifiers.

    Args:
        task: any task.
        settings: some of the settings in `modifiers.MODIFIERS`, by name.

    Raises:
        ValueError: an unknown name, or a value that does not fit.
    """
    modifiers = fit_modifiers(settings, task.scene.body, task.blocks)
    are_active = tuple(modifier.is_active for modifier in modifiers)
    # `Wrapper` is registered as a subclass of `Task`, which type checkers do not see.
    return Modified(task, modifiers, are_active)  # type: ignore[return-value]


def has_active(task: Task, kind: type[Modifier]) -> bool:
    """Return whether a task has a modifier of a class that steps have to call."""
    modifiers = task.changes if isinstance(task, Modified) else ()
    return any(isinstance(modifier, kind) and modifier.is_active for modifier in modifiers)


def sensed_mask(task: Task) -> np.ndarray:
    """Return which numbers (size,) of the observation a robot's sensors measure; see `modifiers.SensorsOnly`."""
    masks = {name: block.are_sensed for name, block in task.blocks.items()}
    if has_active(task, History):
        masks["history"] = task.modifier(History).repeat_masks(masks, len(task.scene.body.joint_names))  # type: ignore[attr-defined]
    return np.concatenate(list(masks.values()))


@dataclasses.dataclass(frozen=True, eq=False)
class Modified(Wrapper):
    """A task with modifiers.

    Attributes:
        changes: its modifiers, from the body outwards. Actions pass from the last modifier to the first, everything
            else from the first to the last.
        are_active: whether steps have to call each modifier; the same for all environments of a batch.
    """

    from_body = ("changes",)

    changes: tuple[Modifier, ...]
    are_active: tuple[bool, ...]

    @property
    def structure(self) -> Hashable:
        """Which modifiers there are, and the shape of their memory."""
        structures = tuple((type(modifier), modifier.structure) for modifier in self.changes)
        return (self.are_active, *structures)

    def modifier(self, kind: type[_ModifierClass]) -> _ModifierClass:
        """Return the modifier of a class."""
        return self.changes[self._index_of(kind)]  # type: ignore[return-value]

    def state(self, memory: ModifiedMemory, kind: type[Modifier]) -> Any:
        """Return the state of the modifier of a class."""
        return memory.changes.states[self._index_of(kind)]

    def _index_of(self, kind: type[Modifier]) -> int:
        """Return the index of the modifier of a class."""
        for index, modifier in enumerate(self.changes):
            if isinstance(modifier, kind):
                return index
        raise LookupError(f"task {self.name}: no modifier {kind.__name__}")

    def _indices_with(self, method: str) -> list[int]:
        """Return the indices of the active modifiers whose class overrides a method of `Modifier`."""
        indices = []
        for index, modifier in enumerate(self.changes):
            overrides = getattr(type(modifier), method) is not getattr(Modifier, method)
            if self.are_active[index] and overrides:
                indices.append(index)
        return indices

    # Indices of the modifiers that each part of a step calls, in the order of the calls.

    @functools.cached_property
    def _indices_to_act(self) -> list[int]:
        return self._indices_with("act")[::-1]

    @functools.cached_property
    def _indices_to_drive(self) -> list[int]:
        return self._indices_with("drive")

    @functools.cached_property
    def _indices_to_sense(self) -> list[int]:
        return self._indices_with("sense")

    @functools.cached_property
    def _indices_to_measure(self) -> list[int]:
        return self._indices_with("measure")

    @functools.cached_property
    def _indices_to_observe(self) -> list[int]:
        return self._indices_with("observe")

    @functools.cached_property
    def _indices_to_remember(self) -> list[int]:
        return self._indices_with("remember")

    @functools.cached_property
    def _has_center(self) -> bool:
        """Whether actions are positions about a center that the task gives."""
        gives_center = type(self.task.unwrapped).position_center is not Task.position_center
        return gives_center and self.actions == "position"

    @property
    def actions(self) -> str:
        """What an action is: the "torque" of each motor, or the "position" of each joint."""
        return self.modifier(Control).actions

    @functools.cached_property
    def symmetry(self) -> Symmetry:
        """The mirror maps of observations and actions.

        Raises:
            ValueError: a modifier treats one side differently, or the wrapped task has no mirror maps.
        """
        image = mirror.image(self.scene.body)
        for modifier in self.changes:
            modifier.check_mirror(image)
        return super().symmetry

    @functools.cached_property
    def blocks(self) -> Mapping[str, Block]:
        """The blocks of the wrapped task, as modifiers change them."""
        blocks = self.task.blocks
        for index in self._indices_with("blocks"):
            blocks = self.changes[index].blocks(self.scene.body, blocks)
        return blocks

    def start(self, random: np.random.RandomState, stream: Any) -> Start:
        """Draw the start of the wrapped task, then the states of the modifiers; see `modifiers.draws`."""
        scene = self.scene
        start = self.task.start(random, stream)
        episode = draw_episode(scene, random)
        states = tuple(modifier.draw(episode) for modifier in self.changes)
        fields = dict(start.model)
        for modifier, state in zip(self.changes, states, strict=True):
            fields |= modifier.fields(scene, {**scene.model, **fields}, state)
        changes = Changes(elapsed=np.zeros(1, np.uint32), terminated=np.False_, states=states)
        memory = ModifiedMemory(start.memory, changes)
        return start._replace(memory=memory, model=fields)

    def begin(self, memory: ModifiedMemory, readings: Readings) -> ModifiedMemory:
        """Return the memory from which the first step starts."""
        task_memory = self.task.begin(memory.task, readings)
        return self._update_states(ModifiedMemory(task_memory, memory.changes), readings, is_start=True)

    def before(self, memory: ModifiedMemory, action) -> tuple[ModifiedMemory, Inputs]:
        """Return the memory, and the inputs from the wrapped task as modifiers change them.

        The action of the wrapped task, which its reward judges, is the torque that motors are commanded to give in this
        step. It is delayed where actions are, and more than weak or failing motors give.
        """
        elapsed = memory.changes.elapsed
        states = list(memory.changes.states)
        if self._has_center:
            action = self.modifier(Control).add_center(self.task.position_center(memory.task), action)
        for index in self._indices_to_act:
            states[index], action = self.changes[index].act(states[index], action, elapsed)
        task_memory, inputs = self.task.before(memory.task, action)
        for index in self._indices_to_drive:
            inputs = self.changes[index].drive(states[index], inputs, elapsed)
        changes = memory.changes._replace(elapsed=elapsed + np.uint32(1), states=tuple(states))
        return ModifiedMemory(task_memory, changes), inputs

    def after(self, memory: ModifiedMemory, readings: Readings) -> ModifiedMemory:
        """Return the memory after a control step."""
        task_memory = self.task.after(memory.task, readings)
        is_terminated, _ = self.task.ended(task_memory, readings)
        # One boolean for all environments becomes one for each: `all_false` has the leading axes of the memory.
        all_false = memory.changes.terminated & False
        changes = memory.changes._replace(terminated=all_false | is_terminated)
        return self._update_states(ModifiedMemory(task_memory, changes), readings, is_start=False)

    def observe(self, memory: ModifiedMemory, readings: Readings) -> dict:
        """Return the blocks that the wrapped task observes through the sensors, as modifiers change them."""
        elapsed = memory.changes.elapsed
        states = memory.changes.states
        observed = self.task.observe(memory.task, self._sense(states, readings))
        for index in self._indices_to_observe:
            observed = self.changes[index].observe(states[index], observed, elapsed)
        return observed

    def _sense(self, states, readings: Readings) -> Readings:
        """Return the readings as sensors show them."""
        for index in self._indices_to_sense:
            readings = self.changes[index].sense(states[index], readings)
        return readings

    def _update_states(self, memory: ModifiedMemory, readings: Readings, is_start: bool) -> ModifiedMemory:
        """Return the memory with the states that modifiers have after the readings, and after the observation."""
        if self._indices_to_measure:
            states = list(memory.changes.states)
            sensed = self._sense(states, readings)
            for index in self._indices_to_measure:
                states[index] = self.changes[index].measure(states[index], sensed)
            memory = memory._replace(changes=memory.changes._replace(states=tuple(states)))
        if self._indices_to_remember:
            states = list(memory.changes.states)
            observed = self.observe(memory, readings)
            for index in self._indices_to_remember:
                states[index] = self.changes[index].remember(states[index], observed, is_start)
            memory = memory._replace(changes=memory.changes._replace(states=tuple(states)))
        return memory

    @functools.cached_property
    def privileged_blocks(self) -> Mapping[str, Block]:
        """The privileged blocks of the wrapped task and of the modifiers, by name."""
        blocks = dict(self.task.privileged_blocks)
        for modifier in self.changes:
            blocks |= modifier.privileged_blocks(self.scene.body)
        return blocks

    def privileged(self, memory: ModifiedMemory, data) -> dict:
        """Return the privileged observations of the wrapped task and of the modifiers, by name of the block."""
        blocks = dict(self.task.privileged(memory.task, data))
        heading = rotations.yaw(data.qpos[..., 3:7])
        for modifier, state in zip(self.changes, memory.changes.states, strict=True):
            blocks |= modifier.privileged(state, memory.changes.elapsed, heading)
        return blocks

    def read_back(self, blocks: Mapping[str, Any], fields: Mapping[str, Any]) -> dict:
        """Return the privileged blocks whose values a user has changed in the model; see `Modifier.read_back`."""
        changed_blocks = dict(self.task.read_back(blocks, fields))
        for modifier in self.changes:
            changed_blocks |= modifier.read_back(self.scene, blocks, fields)
        return changed_blocks

    @property
    def read_back_fields(self) -> tuple[str, ...]:
        """The fields of the model that `read_back` takes."""
        fields = list(self.task.read_back_fields)
        for modifier in self.changes:
            fields += modifier.read_back_fields
        return tuple(dict.fromkeys(fields))  # each once, in this order

    def progress(self, memory: ModifiedMemory) -> dict:
        """Return the metrics of the wrapped task, and whether the body `fell`, 0 or 1."""
        metrics = self.task.progress(memory.task)
        if "fell" in metrics:
            return metrics
        return metrics | {"fell": memory.changes.terminated * 1.0}

    def markers(self, memory: ModifiedMemory, readings: Readings) -> list[Marker]:
        """Return the markers of the wrapped task and of the modifiers."""
        markers = list(self.task.markers(memory.task, readings))
        elapsed = int(memory.changes.elapsed[0])
        for index in self._indices_with("markers"):
            state = memory.changes.states[index]
            markers += self.changes[index].markers(self.scene, state, readings, elapsed)
        return markers

    def failed_legs(self, memory: ModifiedMemory) -> tuple[str, ...]:
        """Return the names of the legs whose motors have failed, of one environment."""
        legs = list(self.task.failed_legs(memory.task))
        elapsed = int(memory.changes.elapsed[0])
        for modifier, state in zip(self.changes, memory.changes.states, strict=True):
            legs += modifier.failed_legs(self.scene, state, elapsed)
        return tuple(legs)
