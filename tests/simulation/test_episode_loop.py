"""The loop that plays an episode in one environment."""

import dm_env
import numpy as np

from arc_suite.simulation.episode_loop import play_episode


class Countdown:
    """An environment whose observation counts the steps up to an end, and which notes what it is asked for."""

    def __init__(self, length):
        self.length, self.calls = length, []

    def reset(self, seed=None):
        self.calls.append(("reset", seed))
        self.count = 0
        return dm_env.restart(self.count)

    def step(self, action):
        self.calls.append(("step", action))
        self.count += 1
        end = self.count == self.length
        return dm_env.termination(1.0, self.count) if end else dm_env.transition(1.0, self.count)


def act(timestep):
    return 10 * timestep.observation


def test_an_episode_is_played_to_its_end_from_a_seed():
    environment = Countdown(3)
    timesteps = list(play_episode(environment, act, 7))
    assert environment.calls == [("reset", 7), ("step", 0), ("step", 10), ("step", 20)]
    assert [timestep.observation for timestep in timesteps] == [0, 1, 2, 3]
    assert timesteps[0].first() and timesteps[-1].last()


def test_it_stops_early_and_without_a_seed_goes_on_to_the_next_episode():
    environment = Countdown(3)
    assert [timestep.observation for timestep in play_episode(environment, act, max_steps=2)] == [0, 1, 2]
    assert len(list(play_episode(environment, act, max_steps=0))) == 1
    assert environment.calls == [("reset", None), ("step", 0), ("step", 10), ("reset", None)]


def test_the_environment_stands_still_until_the_next_step_is_asked_for():
    environment = Countdown(3)
    offset = np.array(0)
    episode = play_episode(environment, lambda timestep: timestep.observation + offset)
    next(episode)
    offset += 5  # as a command that is set between two steps
    assert next(episode).observation == 1
    assert environment.calls == [("reset", None), ("step", 5)]
