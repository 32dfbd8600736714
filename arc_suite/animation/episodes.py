"""Episodes one after another, under a command that a person sets, with poses between control steps."""

from collections.abc import Callable, Sequence

import mujoco
import numpy as np

from arc_suite.animation import player_controls
from arc_suite.markers import Marker
from arc_suite.simulation.episode_loop import play_episode

# s of simulated time between two pictures; a machine that needs longer for it shows slow motion.
MAX_SECONDS_PER_PICTURE = 0.5


class Episodes:
    """Episodes of one environment under a policy.

    Attributes:
        environment: environment of `arc_suite.load`.
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
            environment: environment of `arc_suite.load`.
            act: maps a `TimeStep` to an action.
        """
        self.environment = environment
        self._act = act
        self.follows_velocities = environment.task.definition.commands.get("command") == 3
        self.control_timestep = environment.control_timestep()
        self.desired: np.ndarray | None = None
        self._pose: Sequence[float] | np.ndarray | None = None
        self._gait: str | None = None
        self._tempo = 1.0
        self.restart()

    def restart(self) -> None:
        """Start the next episode, with the command that a person has set."""
        self._episode = play_episode(self.environment, self._act)
        self.timestep = next(self._episode)
        self.episode_return = 0.0
        self.steps = 0
        self._send_commands()
        self._previous_qpos = self._copy_qpos()
        self._markers = self._task_markers()
        self._previous_markers = self._markers

    def command(self, desired: Sequence[float] | np.ndarray | None) -> None:
        """Set the command, clipped to [-1, 1], or leave it to the task; a task without a command ignores it."""
        if not self.follows_velocities:
            return
        self.desired = None
        if desired is not None:
            self.desired = np.clip(desired, -1.0, 1.0)
        self._send_commands()

    def direct(self, pose: Sequence[float] | np.ndarray | None, gait: str | None, tempo: float = 1.0) -> None:
        """Set pose and gait, or leave them to the task; one that has no such commands ignores it.

        Args:
            pose: see `player_controls.commands`, as `gait` and `tempo`.
            gait: its name.
            tempo: multiple of its frequency.
        """
        self._pose = pose
        self._gait = gait
        self._tempo = tempo
        self._send_commands()

    def step(self, forces: np.ndarray | float = 0.0) -> None:
        """Advance by a control step, or start the next episode where the last one has ended.

        Args:
            forces: (bodies, 6) force, N, and torque, N m, on every body of the model, in the world; or 0.
        """
        if self.timestep.last():
            self.restart()
            return
        self._previous_qpos = self._copy_qpos()
        self.environment.physics.data.xfrc_applied[:] = forces
        self.timestep = next(self._episode)
        self.episode_return += self.timestep.reward
        self.steps += 1
        self._previous_markers = self._markers
        self._markers = self._task_markers()

    def qpos(self, share: float) -> np.ndarray:
        """Return the positions (nq,) at a share, 0 to 1, of the latest control step."""
        model = self.environment.physics.model.ptr
        difference = np.empty(model.nv)
        mujoco.mj_differentiatePos(model, difference, 1.0, self._previous_qpos, self._copy_qpos())
        interpolated_qpos = self._previous_qpos.copy()
        mujoco.mj_integratePos(model, interpolated_qpos, difference, share)
        return interpolated_qpos

    def seconds(self, share: float) -> float:
        """Return the time of the present episode at a share, 0 to 1, of the latest control step, s."""
        return (max(self.steps - 1, 0) + share * min(self.steps, 1)) * self.control_timestep

    def markers(self, share: float) -> list[Marker]:
        """Return the task's debug markers at a share, 0 to 1, of the latest control step."""
        previous_looks = [_without_endpoints(marker) for marker in self._previous_markers]
        looks = [_without_endpoints(marker) for marker in self._markers]
        if previous_looks != looks:
            return self._markers
        interpolated_markers = []
        for previous, present in zip(self._previous_markers, self._markers, strict=True):
            start = (1.0 - share) * previous.start + share * present.start
            end = (1.0 - share) * previous.end + share * present.end
            interpolated_markers.append(present._replace(start=start, end=end))
        return interpolated_markers

    def _send_commands(self) -> None:
        task = self.environment.task.definition
        commands = player_controls.commands(task, self.desired, self._pose, self._gait, self._tempo)
        for name, value in commands.items():
            self.environment.command(name, value)

    def _task_markers(self) -> list[Marker]:
        return self.environment.task.markers(self.environment.physics)

    def _copy_qpos(self) -> np.ndarray:
        return self.environment.physics.data.qpos.copy()


def _without_endpoints(marker: Marker) -> Marker:
    return marker._replace(start=None, end=None)
