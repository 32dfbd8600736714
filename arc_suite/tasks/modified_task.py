"""Tasks with modifiers: any task, disturbed, or with other motors or senses.

A modified task wraps another, which may come from another package, and calls its modifiers in their order. Its memory
holds that of the other.
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
from arc_suite.tasks.modifiers import Control, Modifier, fit_modifiers
from arc_suite.tasks.modifiers.draws import draw_episode
from arc_suite.tasks.readings import Readings
from arc_suite.tasks.wrapper import Wrapper

_Kind = TypeVar("_Kind", bound=Modifier)


class Changes(NamedTuple):
    """Memory of the modifiers.

    Attributes:
        elapsed: (..., 1) uint32, control steps since the start.
        terminated: (...) whether the latest step has ended the episode in failure.
        states: of the modifiers, in their order.
    """

    elapsed: np.ndarray
    terminated: np.ndarray
    states: tuple[Any, ...]


class ModifiedMemory(NamedTuple):
    """Memory of a modified task.

    Attributes:
        task: memory of the task that it wraps.
        changes: memory of the modifiers.
    """

    task: Any
    changes: Changes


def add_modifiers(task: Task, settings: Mapping[str, Any]) -> Task:
    """Return a task with modifiers.

    Args:
        task: any.
        settings: some of the settings in `modifiers.MODIFIERS`, by name.

    Raises:
        ValueError: an unknown name, or a value that does not fit.
    """
    changes = fit_modifiers(settings, task.scene.body, task.blocks)
    # A task by registration, which type checkers do not see.
    return Modified(task, changes, tuple(change.is_active for change in changes))  # type: ignore[return-value]


@dataclasses.dataclass(frozen=True, eq=False)
class Modified(Wrapper):
    """A task with modifiers.

    Attributes:
        changes: its modifiers, from the body outwards: actions pass from the last one to the first, all else from the
            first one to the last.
        are_active: which of them steps have to call; the same for all environments of a batch.
    """

    from_body = ("changes",)

    changes: tuple[Modifier, ...]
    are_active: tuple[bool, ...]

    @property
    def structure(self) -> Hashable:
        """Which modifiers there are, and the shape of their memory."""
        return self.are_active, *((type(change), change.structure) for change in self.changes)

    def modifier(self, kind: type[_Kind]) -> _Kind:
        """Return the modifier of a class."""
        return self.changes[self._index(kind)]

    def state(self, memory: ModifiedMemory, kind: type[Modifier]) -> Any:
        """Return the state of the modifier of a class."""
        return memory.changes.states[self._index(kind)]

    def _index(self, kind: type[Modifier]) -> int:
        return next(index for index, change in enumerate(self.changes) if isinstance(change, kind))

    def _calling(self, method: str) -> list[int]:
        """Return the indices of the active modifiers that have a method of their own."""
        pairs = enumerate(zip(self.changes, self.are_active, strict=True))
        return [
            index
            for index, (change, is_active) in pairs
            if is_active and getattr(type(change), method) is not getattr(Modifier, method)
        ]

    @functools.cached_property
    def _acting(self) -> list[int]:
        return self._calling("act")[::-1]

    @functools.cached_property
    def _driving(self) -> list[int]:
        return self._calling("drive")

    @functools.cached_property
    def _sensing(self) -> list[int]:
        return self._calling("sense")

    @functools.cached_property
    def _measuring(self) -> list[int]:
        return self._calling("measure")

    @functools.cached_property
    def _observing(self) -> list[int]:
        return self._calling("observe")

    @functools.cached_property
    def _remembering(self) -> list[int]:
        return self._calling("remember")

    @property
    def actions(self) -> str:
        """What an action asks of a motor."""
        return self.modifier(Control).actions

    @functools.cached_property
    def symmetry(self) -> Symmetry:
        """The mirror maps of observations and actions; what is drawn is as likely on either side.

        Raises:
            ValueError: a modifier does not treat both sides alike, or as the other task.
        """
        image = mirror.image(self.scene.body)
        for change in self.changes:
            change.check_mirror(image)
        return super().symmetry

    @functools.cached_property
    def blocks(self) -> Mapping[str, Block]:
        """The other task's blocks, as modifiers leave them."""
        blocks = self.task.blocks
        for index in self._calling("blocks"):
            blocks = self.changes[index].blocks(self.scene.body, blocks)
        return blocks

    def start(self, random: np.random.RandomState, stream: Any) -> Start:
        """Draw the other task's start, then what is random in the modifiers; see `modifiers.draws`."""
        scene = self.scene
        start = self.task.start(random, stream)
        episode = draw_episode(scene, random)
        fields = dict(start.model)
        states = tuple(change.draw(episode) for change in self.changes)
        for change, state in zip(self.changes, states, strict=True):
            fields |= change.fields(scene, {**scene.model, **fields}, state)
        memory = ModifiedMemory(start.memory, Changes(np.zeros(1, np.uint32), np.False_, states))
        return start._replace(memory=memory, model=fields)

    def begin(self, memory: ModifiedMemory, readings: Readings) -> ModifiedMemory:
        """Return the other task's memory, and what modifiers measure and observe at the start."""
        inner = self.task.begin(memory.task, readings)
        return self._look(ModifiedMemory(inner, memory.changes), readings, is_start=True)

    def before(self, memory: ModifiedMemory, action) -> tuple[ModifiedMemory, Inputs]:
        """Return the memory, and what the other task writes as modifiers change it.

        The other task is given, and its reward judges, the torques commanded of the motors when they
        arrive; weak and failing motors give less.
        """
        elapsed = memory.changes.elapsed
        states = list(memory.changes.states)
        for index in self._acting:
            states[index], action = self.changes[index].act(states[index], action, elapsed)
        inner, inputs = self.task.before(memory.task, action)
        for index in self._driving:
            inputs = self.changes[index].drive(states[index], inputs, elapsed)
        changes = memory.changes._replace(elapsed=elapsed + np.uint32(1), states=tuple(states))
        return ModifiedMemory(inner, changes), inputs

    def after(self, memory: ModifiedMemory, readings: Readings) -> ModifiedMemory:
        """Return the other task's memory, what modifiers measure and observe, and whether the body has fallen."""
        inner = self.task.after(memory.task, readings)
        changes = memory.changes
        terminated, _ = self.task.ended(inner, readings)
        # With the leading axes of the memory, even where the task returns one boolean for all environments.
        changes = changes._replace(terminated=(changes.terminated & False) | terminated)
        return self._look(ModifiedMemory(inner, changes), readings, is_start=False)

    def observe(self, memory: ModifiedMemory, readings: Readings) -> dict:
        """Return the other task's blocks as sensors show them and modifiers change them."""
        elapsed = memory.changes.elapsed
        states = memory.changes.states
        observed = self.task.observe(memory.task, self._sense(states, readings))
        for index in self._observing:
            observed = self.changes[index].observe(states[index], observed, elapsed)
        return observed

    def _sense(self, states, readings: Readings) -> Readings:
        """Return the readings as sensors show them."""
        for index in self._sensing:
            readings = self.changes[index].sense(states[index], readings)
        return readings

    def _look(self, memory: ModifiedMemory, readings: Readings, is_start: bool) -> ModifiedMemory:
        """Return the memory with what modifiers measure, and what they remember of the observation."""
        if self._measuring:
            states = list(memory.changes.states)
            sensed = self._sense(states, readings)
            for index in self._measuring:
                states[index] = self.changes[index].measure(states[index], sensed)
            memory = memory._replace(changes=memory.changes._replace(states=tuple(states)))
        if self._remembering:
            states = list(memory.changes.states)
            observed = self.observe(memory, readings)
            for index in self._remembering:
                states[index] = self.changes[index].remember(states[index], observed, is_start)
            memory = memory._replace(changes=memory.changes._replace(states=tuple(states)))
        return memory

    @functools.cached_property
    def privileged_blocks(self) -> Mapping[str, Block]:
        """The other task's, and those of the modifiers."""
        blocks = dict(self.task.privileged_blocks)
        for change in self.changes:
            blocks |= change.privileged_blocks(self.scene.body)
        return blocks

    def privileged(self, memory: ModifiedMemory, data) -> dict:
        """Return the other task's blocks, and those of the modifiers."""
        blocks = dict(self.task.privileged(memory.task, data))
        heading = rotations.yaw(data.qpos[..., 3:7])
        for change, state in zip(self.changes, memory.changes.states, strict=True):
            blocks |= change.privileged(state, memory.changes.elapsed, heading)
        return blocks

    def read_back(self, blocks: Mapping[str, Any], fields: Mapping[str, Any]) -> dict:
        """Return the privileged blocks that changed fields of the model decide; see `Modifier.read_back`."""
        changed = dict(self.task.read_back(blocks, fields))
        for change in self.changes:
            changed |= change.read_back(self.scene, blocks, fields)
        return changed

    @property
    def read_back_fields(self) -> tuple[str, ...]:
        """The fields of the model that `read_back` takes."""
        fields = [*self.task.read_back_fields, *(name for change in self.changes for name in change.read_back_fields)]
        return tuple(dict.fromkeys(fields))

    def progress(self, memory: ModifiedMemory) -> dict:
        """Return the other task's metrics, and whether the body `fell`, 0 or 1."""
        metrics = self.task.progress(memory.task)
        return metrics if "fell" in metrics else metrics | {"fell": memory.changes.terminated * 1.0}

    def markers(self, memory: ModifiedMemory, readings: Readings) -> list[Marker]:
        """Return the other task's markers, and those of the modifiers."""
        markers = list(self.task.markers(memory.task, readings))
        elapsed = int(memory.changes.elapsed[0])
        for index in self._calling("markers"):
            state = memory.changes.states[index]
            markers += self.changes[index].markers(self.scene, state, readings, elapsed)
        return markers

    def failed_legs(self, memory: ModifiedMemory) -> tuple[str, ...]:
        """Return the names of the legs whose motors have failed, of one environment."""
        legs = list(self.task.failed_legs(memory.task))
        elapsed = int(memory.changes.elapsed[0])
        for change, state in zip(self.changes, memory.changes.states, strict=True):
            legs += change.failed_legs(self.scene, state, elapsed)
        return tuple(legs)
