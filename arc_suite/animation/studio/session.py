"""One creature in real time: other threads ask for another one, set its command, or have the loop do something."""

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

STATES = 30.0  # a second, at most, that are shown
_WINDOW = 2.0  # s, over which the pace is a mean
_KICK = 1.0  # change of the torso's velocity, sqrt(g h)


class Walker:
    """A creature with its episodes, in its own time.

    Attributes:
        creature: that walks.
        episodes: of the creature.
        history: of the episodes.
    """

    def __init__(self, creature: Creature):
        """Start the first episode."""
        self.creature = creature
        self.episodes = Episodes(creature.environment, creature.act)
        self.history = History(self.episodes)
        self._ahead = 0.0

    @property
    def share(self) -> float:
        """Return the share, 0 to 1, of the latest control step that has passed."""
        return self._ahead / self.episodes.control_timestep

    def advance(self, seconds: float) -> float:
        """Take the control steps of some time, and return how long they are, s."""
        step, steps = self.episodes.control_timestep, 0
        self._ahead += seconds
        while self._ahead >= step:
            self.episodes.step()
            self.history.observe()
            self._ahead, steps = self._ahead - step, steps + 1
        return steps * step


class Session:
    """The creature that walks, one that was kept next to it, and the sketch that is asked for next.

    A creature is made in a thread of its own while the one before walks on. All else happens in the loop of `run`.

    Attributes:
        walker: of the latest sketch.
        kept: that walks next to it under the same command, or None.
        error: one line, why the latest sketch made no creature; empty if it did.
        desired: (3,) command that visitors have set; None for that of the task.
        pose: (6,) that they have set, or None; see `posture`.
        gait: name of the gait that they have set, or None, and multiple of its frequency.
        paused: whether time stands still.
        pace: simulated seconds a second, of late.
        open: whether `run` goes on.
    """

    def __init__(self, sketch: Sketch):
        """Open the first creature; errors as `creature.opened`."""
        self._calls: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._maker = concurrent.futures.ThreadPoolExecutor(1, "creature")
        self._asked = self._tried = sketch
        self.error, self.paused, self.open = "", False, True
        self.pace = 1.0
        self.desired: np.ndarray | None = np.array((1.0, 0.0, 0.0))
        self.pose: np.ndarray | None = np.zeros(6)
        self.gait: tuple[str | None, float] = player_controls.OWN_GAIT, 1.0
        self.kept: Walker | None = None
        self._replace(open_creature(sketch))

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

    def ask(self, sketch: Sketch) -> None:
        """Ask for another creature, from any thread; of several that wait, the latest is made."""
        self._asked = sketch
        self._maker.submit(self._make)

    def keep(self, kept: bool) -> None:
        """Have the present creature walk next to all later ones, or the kept one leave, from any thread."""
        self._maker.submit(self._keep, self.creature.sketch if kept else None)

    def refuse(self, line: str) -> None:
        """Tell why something makes no creature, from any thread."""
        self.do(functools.partial(self._refuse, line))

    def do(self, call: Callable[[], None]) -> None:
        """Have the loop call something between two control steps, from any thread."""
        self._calls.put(call)

    def command(self, desired: Sequence[float] | None) -> None:
        """Set the command, now and for later creatures, from any thread; None leaves it to the task."""

        def change():
            self.desired = None if desired is None else np.array(desired)
            self._direct()

        self.do(change)

    def direct(self, pose: Sequence[float] | None, gait: str | None, tempo: float = 1.0) -> None:
        """Set pose and gait, now and for later creatures, from any thread; see `Episodes.direct`."""

        def change():
            self.pose, self.gait = None if pose is None else np.array(pose), (gait, tempo)
            self._direct()

        self.do(change)

    @property
    def commands(self) -> dict[str, Any]:
        """What visitors have set of the commands of the creature's task, by name."""
        task = self.creature.environment.task.definition
        return player_controls.commands(task, self.desired, self.pose, *self.gait)

    def kick(self, angle: float) -> None:
        """Kick the torso in a direction of the world, rad, from any thread."""

        def change():
            for walker in self._walkers():
                environment = walker.episodes.environment
                gravity = -environment.physics.model.opt.gravity[2]
                speed = _KICK * np.sqrt(gravity * environment.task.body.torso.standing_height)
                environment.physics.data.qvel[:2] += speed * np.array((np.cos(angle), np.sin(angle)))

        self.do(change)

    def restart(self) -> None:
        """Start the next episode, from any thread."""
        self.do(lambda: [walker.episodes.restart() for walker in self._walkers()])

    def pause(self, paused: bool) -> None:
        """Stop the time, or let it go on, from any thread."""
        self.paused = paused

    def close(self) -> None:
        """End `run`, from any thread."""
        self.open = False

    def run(self, show: Callable[["Session"], None]) -> None:
        """Step in real time until the session is closed; a machine that is too slow shows slow motion.

        Args:
            show: called after control steps, `STATES` times a second at most, with the session.
        """
        begun = last = due = time.monotonic()
        simulated = 0.0
        while self.open:
            while not self._calls.empty():
                self._calls.get()()
            now = time.monotonic()
            passed = 0.0 if self.paused else min(now - last, MAX_SECONDS_PER_PICTURE)
            last = now
            simulated += self.walker.advance(passed)
            if self.kept is not None:
                self.kept.advance(passed)
            show(self)
            if now - begun > _WINDOW:
                self.pace, begun, simulated = simulated / (now - begun), now, 0.0
            due = max(due + 1.0 / STATES, now := time.monotonic())
            time.sleep(due - now)
        self._maker.shutdown(cancel_futures=True)

    def _make(self) -> None:
        sketch = self._asked
        if sketch == self._tried:
            return
        self._tried = sketch
        try:
            creature = open_creature(sketch)
        except (ValueError, OSError) as error:
            self.do(functools.partial(self._refuse, str(error)))
        except Exception as error:  # a mistake of ours: the creature before walks on
            traceback.print_exc()
            self.do(functools.partial(self._refuse, f"{type(error).__name__}: {error}"))
        else:
            self.do(functools.partial(self._replace, creature))

    def _refuse(self, line: str) -> None:
        self.error = " ".join(line.split())

    def _keep(self, sketch: Sketch | None) -> None:
        kept = None if sketch is None else Walker(open_creature(sketch))  # with an environment of its own

        def change():
            self.kept = kept
            self._direct()

        self.do(change)

    def _replace(self, creature: Creature) -> None:
        self.walker, self.error = Walker(creature), ""
        self._direct()

    def _walkers(self) -> list[Walker]:
        return [self.walker] if self.kept is None else [self.walker, self.kept]

    def _direct(self) -> None:
        """Have all that walk follow the command."""
        for walker in self._walkers():
            walker.episodes.command(self.desired)
            walker.episodes.direct(self.pose, *self.gait)
