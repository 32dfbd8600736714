"""Lets random bodies walk and counts those that do: by seed, so that anyone can try bodies that nobody has seen.

A body walks if it does not fall, its torso touches the ground for less than 1 % of the time, it
gets more than one body length and 0.02 sqrt(g h) forward, and drifts sideways less than that.

  python tools/walk_census.py --first 0 --count 500
  python tools/walk_census.py --first 7000 --count 100 --legs 4 --picture failures.png
"""

import contextlib

import imageio.v3 as imageio
import numpy as np
from absl import flags

from arc_suite import files
from arc_suite.cli import films, program
from arc_suite.evaluation import census
from arc_suite.robots import generator

_FIRST = flags.DEFINE_integer("first", 0, "First seed.", lower_bound=0)
_COUNT = flags.DEFINE_integer("count", 500, "Number of bodies.", lower_bound=1)
_LEGS = flags.DEFINE_integer("legs", None, "Number of legs. [default: random]", *generator.LEGS)
_LINKS = flags.DEFINE_integer("links", None, "Actuated links of each leg. [default: random, 2 to 4]", *generator.LINKS)
_SECONDS = flags.DEFINE_float("seconds", 20.0, "How long each body walks.", lower_bound=1.0)
_FROUDE = flags.DEFINE_float("froude", None, "Wanted speed in sqrt(g h); negative for backwards. [default: 0.25]")
_IN_PHASE = flags.DEFINE_bool("in_phase", False, "Move all legs at once: a check that the census tells bad from good.")
_PROCESSES = flags.DEFINE_integer("processes", None, "How many at a time. [default: one per core]", lower_bound=1)
_PICTURE = flags.DEFINE_string("picture", None, "Write a picture of up to twelve failures to this file.")


def picture(outcomes: list[census.Outcome]) -> np.ndarray:
    """How up to twelve bodies ended, each with its seed and what it failed by: (height, width, 3) uint8."""
    views = []
    for outcome in outcomes[:12]:
        environment, _ = census.follow(outcome.trial)
        caption = f"seed {outcome.trial.seed}: {outcome.legs} x {outcome.links}, {', '.join(outcome.failures)}"
        views.append(films.captioned(environment.physics.render(300, 400, "portrait"), caption))
        environment.close()
    columns = min(4, len(views))
    views += [np.zeros_like(views[0])] * (-len(views) % columns)
    return films.grid(views, columns)


def main() -> None:
    """Runs the census and prints it."""
    trials = [
        census.Trial(seed, _LEGS.value, _LINKS.value, _SECONDS.value, _FROUDE.value, _IN_PHASE.value)
        for seed in range(_FIRST.value, _FIRST.value + _COUNT.value)
    ]
    with contextlib.ExitStack() as stack:
        path = _PICTURE.value and stack.enter_context(files.writing(_PICTURE.value))
        outcomes = list(census.census(trials, _PROCESSES.value))
        print(census.table(outcomes))
        print(census.summary(outcomes))
        failed = [outcome for outcome in outcomes if outcome.failures]
        for outcome in failed:
            print(
                f"seed {outcome.trial.seed}: {outcome.legs} legs, {outcome.links} links: {', '.join(outcome.failures)}"
            )
        if path:
            imageio.imwrite(path, picture(failed or outcomes))


if __name__ == "__main__":
    program.run(main)
