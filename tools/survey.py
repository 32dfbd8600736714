"""Let random bodies walk and count those that do.

Every seed is a body. A body walks if it does not fall, its torso touches the ground for less than 1 % of
the time, and it reaches 0.7 of the target speed, which is the task's target velocity or its command.
The summary says how many reach 0.9 of it.

  python tools/survey.py --first 0 --count 500
  python tools/survey.py --family varied --count 500
  python tools/survey.py --first 7000 --count 100 --legs 4 --picture failures.png
"""

import contextlib

import imageio.v3 as imageio
import numpy as np
from absl import flags
from surveys import walks

from arc_suite import checks, files, registry
from arc_suite.bodies import generator
from arc_suite.bodies.families import sound_body
from arc_suite.cli import program
from arc_suite.cli.flags import MAX_COUNT, define_task, task_from_flags
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import protocol
from arc_suite.registry import FAMILIES
from arc_suite.robots.spec import Body
from arc_suite.simulation import films

FLAGS = flags.FLAGS
define_task()
flags.DEFINE_string(
    "family", "random", f"Of the bodies: {', '.join(FAMILIES)}, or module:name of one that another package has."
)
flags.DEFINE_integer("first", 0, "First seed.", lower_bound=0)
flags.DEFINE_integer("count", 500, "Number of bodies.", 1, MAX_COUNT)
flags.DEFINE_integer("legs", None, "Number of legs, of the family random. [default: random]", *generator.LEG_RANGE)
flags.DEFINE_integer(
    "links", None, "Actuated links of each leg, of the family random. [default: random, 2 to 4]", *generator.LINK_RANGE
)
flags.DEFINE_float("seconds", 20.0, "How long each body walks.", lower_bound=1.0)
flags.DEFINE_integer("processes", None, "Bodies at a time, each in a process. [default: one per core]", lower_bound=1)
flags.DEFINE_string("picture", None, "File to write a picture of up to twelve failures to.")


def picture(outcomes: list[walks.Outcome]) -> np.ndarray:
    """Return the ends of up to twelve walks, each with its seed and failures: (height, width, 3) uint8."""
    views = []
    for outcome in outcomes[:12]:
        environment, _ = walks.play(outcome.case)
        caption = ", ".join((f"seed {outcome.case.seed}: {outcome.legs} x {outcome.links}", *outcome.failures))
        view = environment.physics.render(300, 400, "portrait", quality="still")
        views.append(films.add_caption(view, caption))
        environment.close()
    return films.grid(views, min(4, len(views)))


def member(seed: int) -> Body:
    """Return the body of a seed.

    Raises:
        ValueError: an unknown family, or a number of legs or links for another than `random`.
    """
    if FLAGS.family == "random":
        return sound_body(seed, FLAGS.legs, FLAGS.links)
    for name in ("legs", "links"):
        if FLAGS[name].value is not None:
            raise ValueError(f"--{name}={FLAGS[name].value}: goes with the family random, not with {FLAGS.family}")
    return registry.family_of(FLAGS.family)(seed)


def main() -> None:
    """Run the survey and print it."""
    name, settings = task_from_flags()
    settings = {"time_limit": FLAGS.seconds} | settings
    seeds = range(FLAGS.first, FLAGS.first + FLAGS.count)
    with contextlib.ExitStack() as stack:
        if FLAGS.picture:
            checks.extension(FLAGS.picture, [".png"])
        path = FLAGS.picture and stack.enter_context(files.writing(FLAGS.picture))
        first = Setup.of(member(seeds[0]), name, settings)
        _ = first.definition  # finds out before all bodies are made, and processes, whether the settings fit
        protocol.check_ends(first.task_kwargs["time_limit"])
        cases = [walks.Case(Setup.of(member(seed), name, settings), seed) for seed in seeds]
        outcomes = list(walks.survey(cases, FLAGS.processes, program.progress))
        print(walks.table(outcomes))
        print(walks.summary(outcomes))
        failures = [outcome for outcome in outcomes if outcome.failures]
        for outcome in failures:
            print(
                f"seed {outcome.case.seed}: {outcome.legs} legs, {outcome.links} links: {', '.join(outcome.failures)}"
            )
        if path:
            imageio.imwrite(path, picture(failures or outcomes))


if __name__ == "__main__":
    program.run(main)
