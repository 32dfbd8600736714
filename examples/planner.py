"""Plan by random shooting: try actions from a snapshot, go back, and take the best one.

Run `python examples/planner.py`; it prints the return of 20 planned control steps.
"""

import numpy as np

import arc_suite


def planned(environment, random, candidates=32, horizon=6):
    """Return the action (motors,) that earns the most while it is held for a horizon of control steps."""
    start = environment.snapshot()
    actions = random.uniform(-1.0, 1.0, (candidates, *environment.action_spec().shape))
    returns = [held(environment, start, action, horizon) for action in actions]
    environment.restore(start)
    return actions[np.argmax(returns)]


def held(environment, start, action, steps):
    """Return what an action earns from a snapshot on, held for some steps or until the episode ends."""
    environment.restore(start)
    earned = 0.0
    for _ in range(steps):
        timestep = environment.step(action)
        earned += timestep.reward
        if timestep.last():
            break
    return earned


def main(steps=20, seed=0):
    """Walk by planned actions, and return what they earn."""
    environment, random = arc_suite.load("tick", "walk"), np.random.default_rng(seed)
    environment.reset(seed=seed)
    return sum(environment.step(planned(environment, random)).reward for _ in range(steps))


if __name__ == "__main__":
    print(f"return {main():.1f}")
