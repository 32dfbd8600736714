"""The course of a walk from control step to control step: the same for one simulation and for a batch."""

import collections

import numpy as np

from arc_suite.tasks import terms as rewards
from arc_suite.tasks.readings import Layout, component, read


def checked_action(action, shape: tuple[int, ...]) -> np.ndarray:
    """The action as float64, clipped to [-1, 1].

    Args:
        action: of the shape.
        shape: (..., motors)

    Raises:
        ValueError: another shape, not numbers, or NaN; one line that names the index.
    """
    try:
        array = np.asarray(action, dtype=float)
    except (TypeError, ValueError):
        numbers = " x ".join(map(str, shape))
        raise ValueError(f"action: expected {numbers} numbers, got {type(action).__name__}") from None
    if array.shape != shape:
        raise ValueError(f"action: expected shape {shape}, got {array.shape}")
    invalid = np.isnan(array)
    if np.count_nonzero(invalid):
        index = np.argwhere(invalid)[0]
        raise ValueError(f"action[{', '.join(map(str, index))}]: expected a number from -1 to 1, got nan")
    return array.clip(-1.0, 1.0)


def blocks(vector: np.ndarray, joints: int) -> collections.OrderedDict:
    """An observation vector (..., size) as the named blocks of `Walker.observation`, views of it."""
    velocities, contact_forces = 5 + joints, 11 + 2 * joints
    return collections.OrderedDict(
        posture=vector[..., :velocities],
        velocities=vector[..., velocities:contact_forces],
        contact_forces=vector[..., contact_forces:-2],
        gait_clock=vector[..., -2:],
    )


class Walker:
    """What one walk, or each walk of a batch, remembers between control steps, and what follows from it.

    A control step is `before_step`, the simulation's substeps, `after_step`, `reward`, and
    `observation` or `observation_vector`.

    Attributes:
        phase: (...) of the gait clock, rad in [0, 2 pi).
        terms: the ten unweighted terms of the latest reward by name, each (...); empty before it.
    """

    def __init__(self, settings, layout: Layout, control_timestep: float, joints: int, rows: tuple[int, ...] = ()):
        """Prepares to walk.

        Args:
            settings: `walk.Settings`.
            layout: of the body in the model.
            control_timestep: s.
            joints: number of motors.
            rows: leading axes: () for one simulation, (n,) for a batch.
        """
        self._parameters, self._weights = settings.parameters, settings.weights
        self._layout = layout
        self._control_timestep = control_timestep
        self._clock = rewards.TWO_PI * settings.parameters.gait_frequency * control_timestep  # rad a step
        self._shape = (*rows, joints)
        self.terms = {}
        self.restart()

    def restart(self, rows=None) -> None:
        """Begins episodes: the gait clock at 0, no previous action.

        Args:
            rows: mask or indices of the walks of a batch that begin; None for all.
        """
        if rows is None:
            self.phase = np.zeros(self._shape[:-1])
            self._action = np.zeros(self._shape)
            self._readings = None
        else:
            self.phase[rows] = 0.0
            self._action[rows] = 0.0

    def before_step(self, action, data) -> None:
        """Applies the action, clipped to [-1, 1].

        Args:
            action: (..., motors)
            data: `MjData`, or anything with its fields under the walker's leading axes.

        Raises:
            ValueError: the action has another shape or holds NaN; nothing has changed then.
        """
        action = checked_action(action, self._shape)
        self._previous_action, self._action = self._action, action
        self._x = component(data.qpos, 0) + 0.0  # not a view
        data.ctrl[...] = action

    def after_step(self, data) -> None:
        """Advances the gait clock, measures the step's progress and takes the readings."""
        self.phase = (self.phase + self._clock) % rewards.TWO_PI
        self._forward_velocity = (component(data.qpos, 0) - self._x) / self._control_timestep
        self._readings = read(data, self._layout)

    def reward(self, data, diverged=None):
        """The weighted sum (...) of the ten terms after a step; the terms stay in `terms`.

        Args:
            data: `MjData`, or anything with its fields under the walker's leading axes.
            diverged: (...) whose physics diverged within the step, with all terms 0; None for nobody's.
        """
        step = rewards.Step(self.phase, self._forward_velocity, self._action, self._previous_action)
        terms = rewards.terms(self._readings or read(data, self._layout), step, self._parameters)
        if diverged is not None:
            terms = {name: np.where(diverged, 0.0, term)[()] for name, term in terms.items()}
        self.terms = terms
        return rewards.total(terms, self._weights)

    def observation_vector(self, data, rows=None, dtype=None) -> np.ndarray:
        """The paper's observation (Section 3), in new memory.

        Args:
            data: `MjData`, or anything with its fields under the walker's leading axes.
            rows: mask or indices of the walks of a batch whose data this is; None for all.
            dtype: of the vector; None for that of the data.

        Returns:
            (..., 13 + 2 * joints + 6 * parts): torso height, torso quaternion, joint angles; torso
            linear (world) and angular (body) velocity, joint velocities; torque and force on each
            part, clipped to [-1, 1]; sine and cosine of the phase.
        """
        if rows is None:
            # The readings that after_step took serve the observation of that step, but no later one.
            phase, readings, self._readings = self.phase, self._readings, None
        else:
            phase, readings = self.phase[rows], None
        blocks = (
            data.qpos[..., self._layout.pose],
            data.qvel[..., self._layout.velocities],
            (readings or read(data, self._layout)).contact_forces,
            np.sin(phase)[..., None],
            np.cos(phase)[..., None],
        )
        return np.concatenate(blocks, axis=-1, dtype=dtype)

    def observation(self, data) -> collections.OrderedDict:
        """The observation vector as named blocks, views of it in its order.

        Returns:
            posture (..., 5 + joints), velocities (..., 6 + joints), contact_forces (..., 6 * parts)
            and gait_clock (..., 2).
        """
        return blocks(self.observation_vector(data), self._shape[-1])

    def fallen(self, data):
        """Whose torso has left its healthy range: (...) booleans."""
        return ~rewards.healthy(component(data.qpos, 2), self._parameters)
