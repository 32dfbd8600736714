"""Who acts in the rows of a vector environment, each row an episode of its own.

An actor has `begin(row, seed)`, which starts the episode of a seed in a row, and is called with
observations (rows, size) and the rewards (rows,) of the step before for actions (rows, joints).
What it does in an episode depends on nothing but the episode's seed and observations.
"""

from collections.abc import Callable, Sequence

import dm_env
import numpy as np

from arc_suite import policies
from arc_suite.cpg import Demonstrator
from arc_suite.data.settings import Settings
from arc_suite.tasks.walker import blocks, checked_action


def actor(settings: Settings, rows: int):
    """The actor that settings ask for."""
    joints, steps = len(settings.body.joint_names), settings.steps
    if settings.policy == "cpg":
        made = Mixture([Demonstrator(settings.body, preset) for preset in settings.presets], rows)
    elif settings.policy == "zero":
        made = Script(lambda seed: (), rows, joints)
    elif settings.policy == "random":
        made = Script(lambda seed: np.random.default_rng(seed).uniform(-1.0, 1.0, (steps, joints)), rows, joints)
    else:
        made = Individuals(settings, rows)
    if not settings.noise:
        return made

    def noise(seed):
        # The 1 keeps this stream apart from that of the random policy.
        return np.random.default_rng((seed, 1)).normal(0.0, settings.noise, (steps, joints))

    return Sum(made, Script(noise, rows, joints))


class Script:
    """Actions that are known before the episode starts."""

    def __init__(self, script: Callable[[int], Sequence], rows: int, joints: int):
        """Takes a function of a seed that gives the actions (steps, joints) of its episode; past their end, 0."""
        self._script = script
        self._scripts = [()] * rows
        self._clock = [0] * rows
        self._shape = (rows, joints)

    def begin(self, row: int, seed: int) -> None:
        """Starts the episode of a seed in a row."""
        self._scripts[row] = self._script(seed)
        self._clock[row] = 0

    def __call__(self, observations, rewards) -> np.ndarray:
        """The next actions."""
        actions = np.zeros(self._shape)
        for row, (script, step) in enumerate(zip(self._scripts, self._clock, strict=True)):
            if step < len(script):
                actions[row] = script[step]
                self._clock[row] += 1
        return actions


class Sum:
    """The sum of what two actors do."""

    def __init__(self, first, second):
        """Takes the actors."""
        self._actors = first, second

    def begin(self, row: int, seed: int) -> None:
        """Starts the episode of a seed in a row."""
        for one in self._actors:
            one.begin(row, seed)

    def __call__(self, observations, rewards) -> np.ndarray:
        """The sum of the actions."""
        return sum(one(observations, rewards) for one in self._actors)


class Mixture:
    """Demonstrators that take turns from seed to seed."""

    def __init__(self, demonstrators: Sequence[Demonstrator], rows: int):
        """Takes the demonstrators; the episode of seed s is that of the one at s modulo their number."""
        self._demonstrators = demonstrators
        self._chosen = np.zeros(rows, int)

    def begin(self, row: int, seed: int) -> None:
        """Starts the episode of a seed in a row."""
        self._chosen[row] = seed % len(self._demonstrators)
        for demonstrator in self._demonstrators:
            demonstrator.reset([row])

    def __call__(self, observations, rewards) -> np.ndarray:
        """The actions."""
        actions = np.stack([demonstrator(observations) for demonstrator in self._demonstrators])
        return actions[self._chosen, np.arange(len(self._chosen))]


class Individuals:
    """A policy from Python's path, made anew for every episode.

    It gets what it gets in `arc_suite.load`'s environment, a `TimeStep` with named blocks, but
    observations are rounded to float32, as the dataset holds them.
    """

    def __init__(self, settings: Settings, rows: int):
        """Takes what tells the policy."""
        self._settings = settings
        self._policies, self._seeds, self._clock = [None] * rows, [0] * rows, [0] * rows

    def begin(self, row: int, seed: int) -> None:
        """Starts the episode of a seed in a row.

        Raises:
            ValueError: there is no such policy; one line.
        """
        self._policies[row] = policies.policy(self._settings.policy, self._settings.body)
        self._seeds[row], self._clock[row] = seed, 0

    def __call__(self, observations, rewards) -> np.ndarray:
        """The actions.

        Raises:
            ValueError: one of another shape, not of numbers, or with NaN; one line that tells the
                episode and the step.
        """
        joints = len(self._settings.body.joint_names)
        actions = np.zeros((len(self._policies), joints))
        for row, policy in enumerate(self._policies):
            if policy is None:
                continue
            observation = blocks(observations[row].astype(float), joints)
            if self._clock[row] == 0:
                timestep = dm_env.restart(observation)
            else:
                timestep = dm_env.transition(float(rewards[row]), observation)
            try:
                actions[row] = checked_action(policy(timestep), (joints,))
            except ValueError as error:
                where = f"episode of seed {self._seeds[row]}, step {self._clock[row]}"
                raise ValueError(f"policy {self._settings.policy!r}: {where}: {error}") from None
            self._clock[row] += 1
        return actions
