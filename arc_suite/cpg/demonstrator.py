"""Demonstrators: policies that walk by a law, fitted to a task."""

import itertools
import os
import warnings
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from arc_suite import checks, registry, usage
from arc_suite.cpg.law import check_blocks, proprioception, read_blocks, restart_where
from arc_suite.cpg.prescribed import Preset
from arc_suite.cpg.selection import ignored_commands, law, preset_of, suited_preset
from arc_suite.envs import trees
from arc_suite.envs.prepare import prepare_task
from arc_suite.envs.task_view import AnyEnvironment, TaskView
from arc_suite.envs.timestep import TimeStep
from arc_suite.models.soundness import hopeless_flaws
from arc_suite.robots.spec import Body
from arc_suite.tasks.contract import Task
from arc_suite.tasks.modified_task import Modified, has_active
from arc_suite.tasks.modifiers import Control, SensorsOnly


class Demonstrator:
    """A policy that walks by a preset, fitted to a task, in one environment or in a batch.

    Gait, control step, body and velocity units are those of the task. The presets `slow`, `medium`, `fast`, `tuned`
    and `refined` walk straight ahead by their own clock. They read the angles and velocities of joints and the torso's
    orientation alone. The other presets follow the velocity command that a task shows them, by the clock of its gait;
    `planned` computes the command itself; `tracked` follows the motion of the task mimic, `rising` the
    standing pose.

    Its actions are what the task takes. Laws of bodies with motors return torques. In a task of positions it returns
    the positions at which the motors apply these torques: exactly if the observation is exact, and if the positions
    are within the range of the joints.

    In a batch a demonstrator acts by `reset` and `act`, as every policy does. In one environment it is a function of a
    `TimeStep` with named blocks; the first `TimeStep` of an episode restarts it.

    An observation does not name its robot. An observation with another number of joints or rigid bodies is an error.
    A start below half or above twice the standing height is only a warning, since some tasks start so. Another robot
    with the same numbers of parts and about the same height is not recognized, and walks badly.

    Attributes:
        law: law of the preset, fitted to the task; see `cpg.law`.
    """

    def __init__(self, task: AnyEnvironment | TaskView | Task | Body | str | os.PathLike[str], preset: Any = None):
        """Fit a demonstrator.

        Args:
            task: a task of the contract, or an environment with one as its `task`: of `arc_suite.load`,
                `gymnasium.make` or `make_vec`. A body, see `registry.body_of`, stands for the task walk with default
                settings.
            preset: None for the one that suits the task and its body best; see `suited_preset`. Otherwise the name of
                a preset, or parameters of a law: a `Preset`, `SteppingParameters`, ... A number is a target speed as a
                share of sqrt(g h), h being the standing height, negative for backwards. Every body has the names
                `slow`, `medium` and `fast`. Queen, Bastion, Tick and Leaper have `tuned`, with the highest return of
                the paper's law in walk, and `refined`, with the highest return of all laws. `steered`, `surefooted`
                and `reactive` follow a command. `sighted` and `leaping` need a height scan. Leaper has `balanced`.
                `planned` is for the task navigate. `module:name` is a law of another package.

        Warns:
            UserWarning: the task gives commands that the law of the preset does not read.

        Raises:
            ValueError: no preset suits the task, an unknown name, a value out of range, a preset that does not fit or
                whose law reads a block of the observation that the task lacks, a task with `sensors_only`, or a body
                that cannot walk by any preset, as its feet hang far above the floor; or a run learns that declares no
                demonstrator as its source.
        """
        usage.add_source(usage.DEMONSTRATOR)
        body, body_task = _body_and_task(task)
        has_task = body_task is not None
        if body_task is None:
            body_task, _ = prepare_task(body, "walk")
        if has_active(body_task, SensorsOnly):
            reason = "demonstrators read the torso's height and velocity; dagger imitates one that does"
            raise ValueError(f"sensors_only: expected False, as {reason}")
        name = suited_preset(body_task) if preset is None else preset
        parameters = preset_of(body, name) if isinstance(name, str) else name
        # Who gives a `Preset`, parameters of the paper's law, has seen the body walk by it, whatever its flaws.
        if not isinstance(parameters, Preset):
            flaws = hopeless_flaws(body)
            if flaws:
                raise ValueError(f"{body.name} cannot walk: {flaws[0].text}")
        self.law = law(body_task, parameters)
        if has_task:  # a demonstrator of a body may act in any task
            check_blocks(body_task.blocks, self.law.reads)
        if preset is not None:
            _warn_of_ignored_commands(body_task, name, ignored_commands(body_task, self.law))
        self._task = body_task
        # The center of positions may follow from any block.
        self._reads = self.law.reads if _stands_at_center(body_task) else tuple(body_task.blocks)
        self._body = body
        self._starts_lying = body_task.lies
        self._state: Any = None  # of the law; None before the first action
        self._reset_indices: list[int] = []  # environments of the latest reset, until the next action

    def reset(self, indices: Sequence[int], seeds: Sequence[int] = ()) -> None:
        """Start episodes in some environments, given by their indices; seeds have no effect."""
        if self._state is not None:
            num_envs = len(self._state[0])  # arrays of a law's state have a row for each environment
            mask = np.zeros(num_envs, bool)
            mask[indices] = True
            self._state = restart_where(self._state, self.law.initial(len(mask)), mask)
        self._reset_indices = list(indices)

    def act(self, observation: Mapping[str, np.ndarray], rewards: np.ndarray | None = None) -> np.ndarray:
        """Return the actions of a control step.

        Args:
            observation: blocks by name, (environments, size) each, or (size,) of one environment.
            rewards: have no effect.

        Returns:
            (environments, joints) in [-1, 1], or (joints,).

        Raises:
            ValueError: an observation without named blocks, of another body, or without a block of the law; or a
                run learns that declares no demonstrator as its source.
        """
        usage.add_source(usage.DEMONSTRATOR)
        blocks = read_blocks(observation, self._reads, len(self._body.joint_names), len(self._body.part_names))
        is_one_environment = blocks["posture"].ndim == 1
        if is_one_environment:
            blocks = {name: block[None] for name, block in blocks.items()}
        count = len(blocks["posture"])
        if self._state is None or len(self._state[0]) != count:
            self._state = self.law.initial(count)
        self._state, actions = self.law(self._state, blocks)
        actions = _as_actions(self._task, actions, blocks)
        if self._reset_indices and not self._starts_lying:
            torso_heights = blocks["posture"][:, 0]
            self._check_heights(torso_heights[self._reset_indices])
        return actions[0] if is_one_environment else actions

    def snapshot(self) -> dict[str, np.ndarray]:
        """Return the state as arrays by name, for `restore`; empty before the first action."""
        leaves = [] if self._state is None else trees.leaves(self._state)
        return {str(number): np.array(leaf) for number, leaf in enumerate(leaves)}

    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Continue from a snapshot of the same number of environments.

        Raises:
            KeyError: an array is missing.
        """
        if not arrays:  # of a time before the first action
            self._state = None
            return
        initial = self.law.initial(len(arrays["0"]))
        numbers = itertools.count()  # of the leaves, in their order
        self._state = trees.map_leaves(lambda leaf: arrays[str(next(numbers))].copy(), initial)
        self._reset_indices = []

    def __call__(self, timestep: TimeStep) -> np.ndarray:
        """Return the action (joints,) of a dm_env `TimeStep` with named blocks."""
        try:
            is_first = timestep.first()
        except AttributeError:
            kind = type(timestep).__name__
            raise ValueError(f"timestep: expected what reset and step of a dm_env return, got {kind}") from None
        if is_first:
            self.reset([0])
        return self.act(timestep.observation)

    def _check_heights(self, heights: np.ndarray) -> None:
        """Warn if torsos start at heights, m, that suit another body; each start is checked once."""
        self._reset_indices = []
        standing_height = self._body.torso.standing_height
        if ((heights < 0.5 * standing_height) | (heights > 2.0 * standing_height)).any():
            start = "the torso starts below half or above twice that"
            text = f"{self._body.name} stands {standing_height:g} m high, and {start}"
            warnings.warn(f"{text}: is this the demonstrator of another robot?", stacklevel=3)


def _stands_at_center(task: Task) -> bool:
    """Return whether the actions of a task are relative to the standing pose alone."""
    return type(task.unwrapped).observed_position_center is Task.observed_position_center


def _as_actions(task: Task, outputs: np.ndarray, blocks: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return what a law gives, torques or positions of servos, as actions of a task."""
    if not isinstance(task, Modified) or task.actions == "torque":
        return outputs
    control = task.modifier(Control)
    positions = outputs
    if control.is_active:
        _, angles, velocities = proprioception(blocks)
        positions = control.positions(outputs.clip(-1.0, 1.0), angles, velocities)
    center = task.observed_position_center(blocks)
    return positions if center is None else control.subtract_center(center, positions)


def _warn_of_ignored_commands(task: Task, preset: Any, ignored: Sequence[str]) -> None:
    """Warn if a preset, by name or by its parameters, ignores blocks that show what a task commands."""
    if ignored:
        text = f"preset {checks.preview(preset)}: ignores what the task {task.name} commands: {', '.join(ignored)}"
        warnings.warn(f"{text}; {suited_preset(task)} suits it", stacklevel=3)


def _body_and_task(source: Any) -> tuple[Body, Task | None]:
    """Return the body and the task of a body, a task, an environment, or the name of a robot; None for no task."""
    if isinstance(source, Body):
        return source, None
    if isinstance(source, Task):
        return source.scene.body, source
    # A wrapper of Gymnasium holds an environment, which holds a view of its task, which holds the task. `source` may be
    # any of these.
    environment = getattr(source, "unwrapped", source)
    task_view = getattr(environment, "task", environment)
    definition = getattr(task_view, "definition", task_view)
    if isinstance(definition, Task):
        return definition.scene.body, definition
    return registry.body_of(source), None
