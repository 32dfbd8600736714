"""Episodes one after another, under a command that a person sets, with poses between control steps."""

from collections.abc import Callable, Sequence

import mujoco
import numpy as np

from arc_suite.animation import player_controls
from arc_suite.markers import Marker
from arc_suite.simulation.episode_loop import play_episode

MAX_SECONDS_PER_PICTURE = 0.5  # s of simulated time between two pictures; a slower machine shows slow motion
_ENDS = ("start", "end")  # of a debug marker


class Episodes:
    """Episodes of one environment under a policy.

    Attributes:
        environment: of `arc_suite.load`.
        follows_velocities: whether the task has a command of velocities.
        desired: (3,) command that a person has set; None for that of the task.
        timestep: the latest.
        episode_return: sum of the rewards of the present episode.
        steps: control steps of the present episode.
        control_timestep: s.
    """

    def __init__(self, environment, act: Callable):
        """Start the first episode.

        Args:
            environment: of `arc_suite.load`.
            act: maps a `TimeStep` to an action.
        """
        self.environment, self._act = environment, act
        self.follows_velocities = environment.task.definition.commands.get("command") == 3
        self.desired: np.ndarray | None = None
        self._pose: Sequence[float] | np.ndarray | None = None
        self._gait: tuple[str | None, float] = None, 1.0
        self.control_timestep = environment.control_timestep()
        self.restart()

    def restart(self) -> None:
        """Start the next episode, with the command that a person has set."""
        self._episode = play_episode(self.environment, self._act)
        self.timestep = next(self._episode)
        self.episode_return, self.steps = 0.0, 0
        self._command()
        self._before, self._markers = self._qpos(), 2 * (self._asked(),)

    def command(self, desired: Sequence[float] | np.ndarray | None) -> None:
        """Set the command, clipped to [-1, 1], or leave it to the task; a task without a command ignores it."""
        if self.follows_velocities:
            self.desired = None if desired is None else np.clip(desired, -1.0, 1.0)
            self._command()

    def direct(self, pose: Sequence[float] | np.ndarray | None, gait: str | None, tempo: float = 1.0) -> None:
        """Set pose and gait, or leave them to the task; one that has no such commands ignores it.

        Args:
            pose: see `player_controls.commands`, as `gait` and `tempo`.
            gait: its name.
            tempo: multiple of its frequency.
        """
        self._pose, self._gait = pose, (gait, tempo)
        self._command()

    def step(self, forces: np.ndarray | float = 0.0) -> None:
        """Advance by a control step, or start the next episode where the last one has ended.

        Args:
            forces: (bodies, 6) force, N, and torque, N m, on every body of the model, in the world; or 0.
        """
        if self.timestep.last():
            self.restart()
            return
        self._before = self._qpos()
        self.environment.physics.data.xfrc_applied[:] = forces
        self.timestep = next(self._episode)
        self.episode_return += self.timestep.reward
        self.steps += 1
        self._markers = self._markers[1], self._asked()

    def qpos(self, share: float) -> np.ndarray:
        """Return the positions (nq,) at a share, 0 to 1, of the latest control step."""
        model = self.environment.physics.model.ptr
        path, now = np.empty(model.nv), self._before.copy()
        mujoco.mj_differentiatePos(model, path, 1.0, self._before, self._qpos())
        mujoco.mj_integratePos(model, now, path, share)
        return now

    def markers(self, share: float) -> list[Marker]:
        """Return the task's debug markers at a share, 0 to 1, of the latest control step."""
        before, now = self._markers
        without_ends = dict.fromkeys(_ENDS)
        if [each._replace(**without_ends) for each in before] != [each._replace(**without_ends) for each in now]:
            return now
        return [
            new._replace(**{end: (1.0 - share) * getattr(old, end) + share * getattr(new, end) for end in _ENDS})
            for old, new in zip(before, now, strict=True)
        ]

    def _command(self) -> None:
        task = self.environment.task.definition
        for name, value in player_controls.commands(task, self.desired, self._pose, *self._gait).items():
            self.environment.command(name, value)

    def _asked(self) -> list[Marker]:
        return self.environment.task.markers(self.environment.physics)

    def _qpos(self) -> np.ndarray:
        return self.environment.physics.data.qpos.copy()
