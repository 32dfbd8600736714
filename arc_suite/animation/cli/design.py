"""Search for creatures that walk well: the best body of every kind, within budgets.

The search is MAP-Elites over the proportions of bodies; the fitted demonstrator of each body walks it. It writes specs,
a table of all bodies, a picture and pages into a folder. Broken off at any moment, the same command goes on.

  arc-suite design --goal transport --bodies 260 --output gallery
  arc-suite design --goal progress --task stairs --set rise=0.12 --set width=0.3 --bodies 300 --output gallery
  arc-suite design --around tick --bodies 100 --output ticks
"""

import collections
import contextlib
import itertools
import json
import math
import multiprocessing
import pathlib
import signal
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from absl import flags

from arc_suite import checks, files, registry, versions
from arc_suite.animation import pages
from arc_suite.animation.design import axes, gallery
from arc_suite.animation.design.axes import Map
from arc_suite.animation.design.genes import Budget, ProportionGenes, VariantGenes, extent
from arc_suite.animation.design.search import BATCH_SIZE, RANDOM_BODIES, Candidates, Search
from arc_suite.animation.design.trials import GOALS, Outcome, Trial, evaluate, measure_walk
from arc_suite.cli.flags import MAX_COUNT, ROBOT_HELP, named_values
from arc_suite.cli.program import progress, resumable, say
from arc_suite.journal import Journal
from arc_suite.models.standing import standing
from arc_suite.robots.spec import MAX_LENGTH, MAX_NAME, Body
from arc_suite.robots.spec_files import body_to_json
from arc_suite.simulation.cores import use_one_thread

MASS, SPAN = 12.0, 1.5  # of a budget, kg and m
_BOUNDS = {"mass": (1e-6, 1e6), "span": (0.05, MAX_LENGTH), "height": (0.02, MAX_LENGTH), "power": (0.0, 1e6)}
_STEM = MAX_NAME - 7  # of the names of variants, before an underscore and a number

FLAGS = flags.FLAGS
flags.DEFINE_string("goal", "transport", f"{', '.join(GOALS)}; docs/design.md describes them.")
flags.DEFINE_string("task", None, "Task in which bodies are evaluated. [default: that of the goal]")
flags.DEFINE_multi_string("set", [], "Setting of the task, name=value.")
flags.DEFINE_string("around", None, f"A creature whose variants are searched: {ROBOT_HELP}, or a spec file.")
flags.DEFINE_float(
    "amount", 0.1, "Standard deviation of the variants' lengths (logarithm) and headings (rad).", 0.001, 0.5
)
flags.DEFINE_float("mass", None, f"Mass of every body, kg. [default: {MASS:g}, or that of --around]")
flags.DEFINE_float("span", None, f"Greatest extent of a standing body, m. [default: {SPAN:g}, or that of --around]")
flags.DEFINE_float("height", None, "Greatest standing height, m. [default: as the span allows]")
flags.DEFINE_float("power", None, "Greatest mean power of the motors, W/kg. [default: any]")
flags.DEFINE_list(
    "map", None, f"One or two axes of the map: {axes.HELP}. [default: legs,links, with --around height,width]"
)
flags.DEFINE_integer(
    "bodies",
    260,
    f"Bodies to evaluate, rounded up to batches of {BATCH_SIZE}; more make a finished search go on.",
    1,
    MAX_COUNT,
)
flags.DEFINE_integer(
    "random",
    RANDOM_BODIES,
    "Bodies of random genes, with which it begins; as many as --bodies for a control.",
    1,
    MAX_COUNT,
)
flags.DEFINE_integer("steps", 200, "Control steps of the first evaluation; the second takes twice as many.", 10, 500)
flags.DEFINE_integer("seed", 0, "Seed of the search.", 0, 2**32 - 1)
flags.DEFINE_integer("processes", None, "Bodies at a time, each in a process. [default: one per core]", lower_bound=1)
flags.DEFINE_bool("pages", True, "Write pages on which the best walk.")
flags.DEFINE_string("output", None, "Folder to write to, made if need be. Required.", short_name="o")


def budget(around: Body | None) -> Budget:
    """Return what bodies may spend; variants weigh as much as their creature and are no larger, if not said otherwise.

    Raises:
        ValueError: a number out of range.
    """
    mass, span = (standing(around).mass, float(extent(around).max())) if around else (MASS, SPAN)
    usual = {"mass": mass, "span": span}
    given = {name: FLAGS[name].value for name in Budget._fields if FLAGS[name].value is not None}
    return Budget(**{name: checks.number(name, value, *_BOUNDS[name]) for name, value in (usual | given).items()})


@contextlib.contextmanager
def evaluators(processes: int | None) -> Iterator[Callable[[Iterable[tuple]], list[Outcome]]]:
    """Open processes that evaluate bodies: yields a map of `trials.evaluate` over its arguments, in order."""
    if processes == 1:
        yield lambda jobs: list(itertools.starmap(evaluate, jobs))
        return
    # Processes inherit that they ignore Ctrl-C, which the parent answers. Spawned, not forked: a fork would share
    # whatever OpenGL or threads the caller has open.
    answer = signal.signal(signal.SIGINT, signal.SIG_IGN)
    pool = multiprocessing.get_context("spawn").Pool(processes)
    signal.signal(signal.SIGINT, answer)
    with pool:
        yield lambda jobs: pool.starmap(evaluate, jobs, chunksize=1)


def settled(trial: Trial, cells: Map, around: Body | None) -> dict[str, Any]:
    """Return what determines a search, as JSON holds it: lists in place of tuples."""
    values = {"task": trial.task, "goal": trial.goal}
    values |= {name: getattr(trial, name)._asdict() for name in ("budget", "first", "second")}
    values |= {"map": cells._asdict(), "around": around and body_to_json(around), "amount": around and FLAGS.amount}
    values |= {"seed": FLAGS.seed, "random": FLAGS.random, "versions": versions.dependency_versions()}
    return json.loads(json.dumps(values))


def search(folder: pathlib.Path, course: Search, known: Mapping[str, Any]) -> None:
    """Search behind a progress bar, or go on."""
    with contextlib.closing(Journal(folder / "journal.jsonl", known, Candidates.restored)) as journal:
        for batch in journal.generations:
            course.add(batch)
        done, batches = len(journal.generations), -(-FLAGS.bodies // BATCH_SIZE)
        if done >= batches:
            return
        say(f"{folder}: {BATCH_SIZE * batches} bodies")
        with (
            evaluators(FLAGS.processes) as evaluated,
            progress(total=BATCH_SIZE * batches, initial=BATCH_SIZE * done, desc=FLAGS.goal, unit="body") as bar,
        ):
            for _ in range(done, batches):
                journal.append(course.batch(evaluated))
                bar.set_postfix_str(f"{len(course.elites)} cells", refresh=False)
                bar.update(BATCH_SIZE)


def main() -> None:
    """Search, write the files and print a row for each cell."""
    use_one_thread()
    if not FLAGS.output:
        raise ValueError("no folder to write to; say --output=FOLDER")
    goal = GOALS[checks.name(FLAGS.goal, GOALS, "goal")]
    around = None if FLAGS.around is None else registry.body_of(FLAGS.around)
    space = ProportionGenes() if around is None else VariantGenes(around, FLAGS.amount)
    cells = Map.of(FLAGS.map or (("legs", "links") if around is None else ("height", "width")), around, FLAGS.amount)
    task, settings = FLAGS.task or goal.task, named_values("set", FLAGS["set"].value)
    trial = Trial.of(task, settings, FLAGS.goal, budget(around), FLAGS.steps)
    stem = "design" if around is None else around.name[:_STEM]
    course = Search(space, cells, trial, FLAGS.seed, stem, FLAGS.random)
    check(trial, course.middle())
    if FLAGS.pages:
        pages.viewer_script()  # finds out at once whether there is one
    folder = files.folder(FLAGS.output)
    known = settled(trial, cells, around)
    with resumable(folder):
        search(folder, course, known)
    best = gallery.elites(course, cells)
    gallery.write_table(folder / "bodies.csv", course, cells)
    gallery.write_specs(folder / "bodies", best)
    with files.writing_json(folder / "design.json") as report:
        report.update(known, bodies=len(course.candidates), elites=[elite.to_dict() for elite in best])
    if not best:
        reasons = collections.Counter(one.outcome.reason.split(":")[0] for one in course.candidates)
        raise ValueError(f"none of {len(course.candidates)} bodies counts; most often: {reasons.most_common(1)[0][0]}")
    print_table(best, trial)
    views = gallery.pictures(progress(best, "rendering", unit="body", leave=False), cells, trial)
    gallery.write_picture(folder / "gallery.png", views)
    if FLAGS.pages:
        gallery.write_walks(folder / "walks", progress(best, "walking", unit="body", leave=False), cells, trial)
        gallery.write_page(folder / "gallery.html", views, cells, f"{FLAGS.goal} in {task}")
    print(f"wrote {folder}")


def check(trial: Trial, body: Body | str) -> None:
    """Let one body take a step.

    Raises:
        ValueError: no body within the budget, a setting that does not fit, or a task that does not measure the metric.
    """
    if isinstance(body, str):
        raise ValueError(body)
    goal = GOALS[trial.goal]
    for episodes in (trial.first, trial.second):
        tried = measure_walk(body, trial.task, episodes._replace(steps=1), goal)
    if math.isnan(goal.value(tried)):
        raise ValueError(f"--goal={trial.goal}: task {trial.task} does not measure {goal.metric}")


def print_table(best: Iterable[gallery.Elite], trial: Trial) -> None:
    """Print a row for each cell: its body, and the metric in both evaluations."""
    goal = GOALS[trial.goal]
    line = "{:<24} {:>6} {:>12} {:>12} {:>12}"
    print(line.format("cell", "body", goal.metric[:12], "evaluated again", "power, W/kg"))
    for elite in best:
        first, second = (f"{getattr(walk, goal.metric):.3f}" for walk in (elite.first, elite.second))
        print(line.format(elite.label, elite.number, first, second, f"{elite.second.power:.1f}"))
