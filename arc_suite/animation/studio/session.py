"""A session steps one creature in real time.

Other threads ask for another creature, set its command, or have the loop call a function.
"""

import concurrent.futures
import functools
import queue
import time
import traceback
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from arc_suite.animation import player_controls
from arc_suite.animation.episodes import MAX_SECONDS_PER_PICTURE, Episodes
from arc_suite.animation.studio.creature import Creature, open_creature
from arc_suite.animation.studio.history import History
from arc_suite.animation.studio.sketch import Sketch

MAX_STATES_PER_SECOND = 30.0  # that are shown
_PACE_WINDOW = 2.0  # s, over which the pace is a mean
_KICK_SPEED = 1.0  # change of the torso's velocity by a kick, sqrt(g h)


class Walker:
    """A creature that walks its episodes.

    Attributes:
        creature: creature that walks.
        episodes: episodes of the creature.
        history: history of the episodes.
    """

    def __init__(self, creature: Creature):
        """Start the first episode."""
        self.creature = creature
        self.episodes = Episodes(creature.environment, creature.act)
        self.history = History(self.episodes)
        self._time_ahead = 0.0  # s that have passed since the latest control step

    @property
    def share(self) -> float:
        """Return the share, 0 to 1, of the latest control step that has passed."""
        return self._time_ahead / self.episodes.control_timestep

    def advance(self, seconds: float) -> float:
        """Take the control steps of some time, and return how long these steps are together, s."""
        control_timestep = self.episodes.control_timestep
        steps = 0
        self._time_ahead += seconds
        while self._time_ahead >= control_timestep:
            self.episodes.step()
            self.history.observe()
            self._time_ahead -= control_timestep
            steps += 1
        return steps * control_timestep


class Session:
    """The creature that walks, a companion that walks next to it, and the sketch of the next creature.

    A creature is made in a thread of its own while the creature before it walks on. Everything else happens in the loop
    of `run`.

    Attributes:
        walker: walker of the latest sketch.
        companion: an earlier creature that was kept, and follows the same command; None without one.
        error: one line that says why the latest sketch makes no creature; empty if it makes one.
        velocity: (3,) velocity that visitors command, in multiples of the body's own; None for the task's command.
        pose: (6,) pose that visitors command, see `models.posture`; None for that of the task.
        gait: name of the gait that visitors command, None for that of the task, and multiple of its frequency.
        paused: whether time stands still.
        pace: simulated seconds a second, a mean over the last two seconds.
        open: whether `run` goes on.
    """

    def __init__(self, sketch: Sketch):
        """Open the first creature.

        Raises:
            ValueError: as `creature.open_creature`.
            OSError: as `creature.open_creature`.
        """
        self._calls: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._maker = concurrent.futures.ThreadPoolExecutor(1, "creature")
        self._requested_sketch = sketch
        self._tried_sketch = sketch  # the latest of which a creature was made, or could not be made
        self.error = ""
        self.paused = False
        self.open = True
        self.pace = 1.0
        self.velocity: np.ndarray | None = np.array((1.0, 0.0, 0.0))
        self.pose: np.ndarray | None = np.zeros(6)
        self.gait: tuple[str | None, float] = (player_controls.OWN_GAIT, 1.0)
        self.companion: Walker | None = None
        self._replace_creature(open_creature(sketch))

    @property
    def creature(self) -> Creature:
        """Return the creature of the latest sketch."""
        return self.walker.creature

    @property
    def episodes(self) -> Episodes:
        """Return its episodes."""
        return self.walker.episodes

    @property
    def history(self) -> History:
        """Return the history of its episodes."""
        return self.walker.history

    @property
    def commands(self) -> dict[str, Any]:
        """Return the commands of the creature's task that visitors have set, by name."""
        task = self.creature.environment.task.definition
        gait_name, tempo = self.gait
        return player_controls.commands(task, self.velocity, self.pose, gait_name, tempo)

    def ask(self, sketch: Sketch) -> None:
        """Ask for another creature, from any thread. Of several sketches that wait, only the latest is made."""
        self._requested_sketch = sketch
        self._maker.submit(self._make_creature)

    def keep(self, keep: bool) -> None:
        """Make a companion of the present sketch, or remove the companion, from any thread."""
        self._maker.submit(self._make_companion, self.creature.sketch if keep else None)

    def refuse(self, reason: str) -> None:
        """Report why something makes no creature, from any thread."""
        self.do(functools.partial(self._set_error, reason))

    def do(self, call: Callable[[], None]) -> None:
        """Have the loop call a function between two control steps, from any thread."""
        self._calls.put(call)

    def command(self, velocity: Sequence[float] | None) -> None:
        """Set the velocity, now and for later creatures, from any thread; None leaves it to the task."""

        def set_velocity():
            self.velocity = None if velocity is None else np.array(velocity)
            self._send_commands()

        self.do(set_velocity)

    def direct(self, pose: Sequence[float] | None, gait: str | None, tempo: float = 1.0) -> None:
        """Set pose and gait, now and for later creatures, from any thread; see `Episodes.direct`."""

        def set_pose_and_gait():
            self.pose = None if pose is None else np.array(pose)
            self.gait = (gait, tempo)
            self._send_commands()

        self.do(set_pose_and_gait)

    def kick(self, angle: float) -> None:
        """Kick the torso in a direction of the world, rad, from any thread."""

        def kick_torsos():
            for walker in self._walkers():
                environment = walker.episodes.environment
                gravity = -environment.physics.model.opt.gravity[2]
                speed = _KICK_SPEED * np.sqrt(gravity * environment.task.body.torso.standing_height)
                environment.physics.data.qvel[:2] += speed * np.array((np.cos(angle), np.sin(angle)))

        self.do(kick_torsos)

    def restart(self) -> None:
        """Start the next episode, from any thread."""

        def restart_episodes():
            for walker in self._walkers():
                walker.episodes.restart()

        self.do(restart_episodes)

    def pause(self, paused: bool) -> None:
        """Stop the time, or let it go on, from any thread."""
        self.paused = paused

    def close(self) -> None:
        """End `run`, from any thread."""
        self.open = False

    def run(self, show: Callable[["Session"], None]) -> None:
        """Step in real time until the session is closed. A machine that is too slow shows slow motion.

        Args:
            show: called with the session after control steps, at most `MAX_STATES_PER_SECOND` times a second.
        """
        last_time = time.monotonic()
        next_show_time = last_time
        window_start = last_time  # of the present mean of the pace
        simulated_time = 0.0  # s, since the start of the window
        while self.open:
            while not self._calls.empty():
                call = self._calls.get()
                call()
            now = time.monotonic()
            passed_time = 0.0 if self.paused else min(now - last_time, MAX_SECONDS_PER_PICTURE)
            last_time = now
            simulated_time += self.walker.advance(passed_time)
            if self.companion is not None:
                self.companion.advance(passed_time)
            show(self)
            if now - window_start > _PACE_WINDOW:
                self.pace = simulated_time / (now - window_start)
                window_start = now
                simulated_time = 0.0
            time_after_show = time.monotonic()
            next_show_time = max(next_show_time + 1.0 / MAX_STATES_PER_SECOND, time_after_show)
            time.sleep(next_show_time - time_after_show)
        self._maker.shutdown(cancel_futures=True)

    def _make_creature(self) -> None:
        """Make a creature of the sketch that was requested last, in the thread that makes creatures."""
        sketch = self._requested_sketch
        if sketch == self._tried_sketch:
            return
        self._tried_sketch = sketch
        try:
            creature = open_creature(sketch)
        except (ValueError, OSError) as error:
            self.refuse(str(error))
        except Exception as error:  # a mistake of the suite: the creature before walks on
            traceback.print_exc()
            self.refuse(f"{type(error).__name__}: {error}")
        else:
            self.do(functools.partial(self._replace_creature, creature))

    def _make_companion(self, sketch: Sketch | None) -> None:
        """Make a companion, which needs an environment of its own, in the thread that makes creatures."""
        companion = None if sketch is None else Walker(open_creature(sketch))

        def set_companion():
            self.companion = companion
            self._send_commands()

        self.do(set_companion)

    def _set_error(self, reason: str) -> None:
        self.error = " ".join(reason.split())

    def _replace_creature(self, creature: Creature) -> None:
        self.walker = Walker(creature)
        self.error = ""
        self._send_commands()

    def _walkers(self) -> list[Walker]:
        if self.companion is None:
            return [self.walker]
        return [self.walker, self.companion]

    def _send_commands(self) -> None:
        """Have the creature and its companion follow the commands of visitors."""
        gait_name, tempo = self.gait
        for walker in self._walkers():
            walker.episodes.command(self.velocity)
            walker.episodes.direct(self.pose, gait_name, tempo)
