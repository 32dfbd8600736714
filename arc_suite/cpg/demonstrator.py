"""Demonstrators: policies that walk by a law, fitted to a task."""

import warnings
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from arc_suite import registry
from arc_suite.cpg.law import read_blocks, restart_where
from arc_suite.cpg.prescribed import Preset
from arc_suite.cpg.selection import law, preset_of
from arc_suite.envs import trees
from arc_suite.envs.prepare import prepare_task
from arc_suite.models.soundness import hopeless_flaws
from arc_suite.robots.spec import Body
from arc_suite.tasks.contract import Task


class Demonstrator:
    """A policy that walks by a preset, fitted to a task, in one environment or in a batch.

    Gait, units of the command, control step and body are those of the task. The presets slow, medium,
    fast, tuned and refined walk straight ahead by a clock of their own, and read joint angles, joint
    velocities and the torso's orientation alone. All others follow the observed command of a task, by
    its gait's clock; planned finds a command of its own. A demonstrator acts in a batch by `reset` and
    `act`, as every policy does, and in one environment as a function of a `TimeStep` with named blocks;
    the first `TimeStep` of an episode restarts it.

    An observation does not name its robot. One of another number of joints or rigid bodies is refused.
    One whose episode starts below half or above twice the height at which the body stands is warned of,
    since a task may start so. Another robot of as many parts and about the same height cannot be told
    from the body, and walks badly.

    Attributes:
        law: of the preset, fitted to the task; see `cpg.law`.
    """

    def __init__(self, task, preset="medium"):
        """Fit a demonstrator.

        Args:
            task: a task of the contract, or an environment that has one as its `task`: of `arc_suite.load`,
                `gymnasium.make` or `make_vec`. A body, see `registry.body_of`, stands for the task walk with default
                settings.
            preset: a name: slow, medium or fast, which every body has; for the four robots also tuned, which
                earns most of what the paper's law can earn in walk, and refined, which earns most of all;
                steered or surefooted, which follow a command; sighted and leaping, which need a height scan;
                for leaper balanced; planned, for the task navigate; `module:name` of a law of another package. Or
                parameters of a law: a `Preset`, `SteeringParameters`, ...; a number is a target speed as a share of
                sqrt(g h), h being the standing height, negative for backwards.

        Raises:
            ValueError: an unknown name, a value out of range, a preset that does not fit, or a body that
                cannot walk by any preset, as its feet hang far above the floor.
        """
        body, task = _resolved(task)
        if isinstance(preset, str) or preset is None:
            preset = preset_of(body, preset)
        # Presets of the published law were found for a body as it is.
        if not isinstance(preset, Preset) and (found := hopeless_flaws(body)):
            raise ValueError(f"{body.name} cannot walk: {found[0].text}")
        task = task or prepare_task(body, "walk")[0]
        self._body, self._lies, self.law = body, task.lies, law(task, preset)
        self._state, self._started = None, []

    def reset(self, indices: Sequence[int], seeds: Sequence[int] = ()) -> None:
        """Start episodes in some environments, given by their indices; seeds make no difference."""
        if self._state is not None:
            mask = np.zeros(len(self._state[0]), bool)
            mask[indices] = True
            self._state = restart_where(self._state, self.law.initial(len(mask)), mask)
        self._started = list(indices)

    def act(self, observation: Mapping[str, np.ndarray], rewards=None) -> np.ndarray:
        """Return the actions of a control step.

        Args:
            observation: blocks by name, (environments, size) each, or (size,) of one environment.
            rewards: make no difference.

        Returns:
            (environments, joints) in [-1, 1], or (joints,).

        Raises:
            ValueError: not named blocks, those of another body, or a block is missing.
        """
        blocks = read_blocks(observation, self.law.reads, len(self._body.joint_names), len(self._body.part_names))
        alone = blocks["posture"].ndim == 1
        if alone:
            blocks = {name: block[None] for name, block in blocks.items()}
        count = len(blocks["posture"])
        if self._state is None or len(self._state[0]) != count:
            self._state = self.law.initial(count)
        self._state, actions = self.law(self._state, blocks)
        if self._started and not self._lies:
            self._check_heights(blocks["posture"][self._started, 0])
        return actions[0] if alone else actions

    def snapshot(self) -> dict[str, np.ndarray]:
        """Return what it remembers as arrays by name, from which `restore` goes on; empty before the first action."""
        leaves = [] if self._state is None else trees.leaves(self._state)
        return {str(place): np.array(leaf) for place, leaf in enumerate(leaves)}

    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Go on from a snapshot of as many environments.

        Raises:
            KeyError: an array is missing.
        """
        if not arrays:
            return
        like, places = self.law.initial(len(arrays["0"])), iter(range(len(arrays)))
        self._state, self._started = trees.map_leaves(lambda leaf: arrays[str(next(places))].copy(), like), []

    def __call__(self, timestep) -> np.ndarray:
        """Return the action (joints,) of a dm_env `TimeStep` with named blocks."""
        if timestep.first():
            self.reset([0])
        return self.act(timestep.observation)

    def _check_heights(self, heights: np.ndarray) -> None:
        """Warn of starts at heights like those of another body."""
        name, stands, self._started = self._body.name, self._body.torso.standing_height, []
        if ((heights < 0.5 * stands) | (heights > 2.0 * stands)).any():
            text = f"{name} stands {stands:g} m high, and the torso starts below half or above twice that"
            warnings.warn(f"{text}: is this the demonstrator of another robot?", stacklevel=3)


def _resolved(given: Any) -> tuple[Body, Task | None]:
    """The body, and the task of what has one; None for the task walk."""
    if isinstance(given, Body):
        return given, None
    if isinstance(given, Task):
        return given.scene.body, given
    environment = getattr(given, "unwrapped", given)
    task = getattr(environment, "task", environment)
    task = getattr(task, "definition", task)
    if isinstance(task, Task):
        return task.scene.body, task
    return registry.body_of(given), None
