"""Search for creatures that walk well: the best body of every kind, within budgets.

The search is MAP-Elites over the proportions of bodies; the fitted demonstrator of each body walks it. It writes specs,
a table of all bodies, a picture and pages into a folder. Interrupted at any moment, the same command goes on.

  arc-suite design --goal transport --bodies 260 --output gallery
  arc-suite design --goal progress --task stairs --set rise=0.12 --set width=0.3 --bodies 300 --output gallery
  arc-suite design --around tick --bodies 100 --output ticks
  arc-suite design --around go2.xml --goal tracking --bodies 100 --output go2s
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
from arc_suite.animation.design.trials import GOALS, Outcome, Trial, evaluate, goal_of, measure_walk
from arc_suite.cli import outputs
from arc_suite.cli.flags import MAX_COUNT, ROBOT_HELP, named_values, refuse_flags
from arc_suite.cli.program import progress, resumable, say
from arc_suite.journal import Journal
from arc_suite.models.standing import measure_standing
from arc_suite.robots.spec import MAX_LENGTH, MAX_NAME, Body
from arc_suite.robots.spec_files import body_to_json
from arc_suite.simulation.cores import prepare_jax

DEFAULT_MASS = 12.0  # kg, of a budget
DEFAULT_SPAN = 1.5  # m, of a budget
_BUDGET_BOUNDS = {
    "mass": (1e-6, 1e6),  # kg
    "span": (0.05, MAX_LENGTH),  # m
    "height": (0.02, MAX_LENGTH),  # m
    "power": (0.0, 1e6),  # W/kg
}
_MAX_STEM = MAX_NAME - 7  # characters of a creature's name in the names of its variants, before _ and a number

FLAGS = flags.FLAGS
flags.DEFINE_string("goal", "transport", f"{', '.join(GOALS)}, or module:name; docs/design.md describes them.")
flags.DEFINE_string("task", None, "Task in which bodies are evaluated. [default: that of the goal]")
flags.DEFINE_multi_string("set", [], "Setting of the task, name=value.")
flags.DEFINE_string("around", None, f"A creature whose variants are searched: {ROBOT_HELP}, or a spec file.")
flags.DEFINE_float(
    "amount",
    0.1,
    "Standard deviation of the variants' lengths (logarithm) and headings (rad).",
    lower_bound=0.001,
    upper_bound=0.5,
)
flags.DEFINE_float("mass", None, f"Mass of every body, kg. [default: {DEFAULT_MASS:g}, or that of --around]")
flags.DEFINE_float(
    "span", None, f"Greatest extent of a standing body, m. [default: {DEFAULT_SPAN:g}, or that of --around]"
)
flags.DEFINE_float("height", None, "Greatest standing height, m. [default: as the span allows]")
flags.DEFINE_float("power", None, "Greatest mean power of the motors, W/kg. [default: any]")
flags.DEFINE_list(
    "map", None, f"One or two axes of the map: {axes.HELP}. [default: legs,links, with --around height,width]"
)
flags.DEFINE_integer(
    "bodies",
    260,
    f"Bodies to evaluate, rounded up to batches of {BATCH_SIZE}; more make a finished search go on.",
    lower_bound=1,
    upper_bound=MAX_COUNT,
)
flags.DEFINE_integer(
    "random",
    RANDOM_BODIES,
    "Bodies of random genes, with which it begins; as many as --bodies for a control.",
    lower_bound=1,
    upper_bound=MAX_COUNT,
)
flags.DEFINE_integer(
    "steps",
    200,
    "Control steps of the first evaluation; the second takes twice as many.",
    lower_bound=10,
    upper_bound=500,
)
flags.DEFINE_integer("seed", 0, "Seed of the search.", lower_bound=0, upper_bound=2**32 - 1)
flags.DEFINE_integer("processes", None, "Bodies at a time, each in a process. [default: one per core]", lower_bound=1)
flags.DEFINE_bool("pages", True, "Write pages on which the best walk.")
flags.DEFINE_string("output", None, "Folder to write to, made if need be. Required.", short_name="o")


def budget_from_flags(around: Body | None) -> Budget:
    """Return what bodies may spend.

    Unless flags say otherwise, variants weigh as much as their creature and are no larger. Those of an imported robot
    differ in the lengths of their links: their masses follow, and they may be of any size.

    Args:
        around: creature whose variants are searched; None for a search of all bodies.

    Raises:
        ValueError: a number out of range, or a mass for variants of an imported robot.
    """
    limits: dict[str, float]
    if around is None:
        limits = {"mass": DEFAULT_MASS, "span": DEFAULT_SPAN}
    elif around.source:
        refuse_flags(["mass"], f"goes without --around {around.name}: links of an imported robot weigh what they weigh")
        limits = {}
    else:
        limits = {"mass": measure_standing(around).mass, "span": float(extent(around).max())}
    for name in Budget._fields:
        if FLAGS[name].value is not None:
            limits[name] = FLAGS[name].value
    checked_limits = {name: checks.number(name, value, *_BUDGET_BOUNDS[name]) for name, value in limits.items()}
    return Budget(**{"mass": None, **checked_limits})


@contextlib.contextmanager
def open_evaluators(processes: int | None) -> Iterator[Callable[[Iterable[tuple]], list[Outcome]]]:
    """Yield a function that maps tuples of arguments of `trials.evaluate` to outcomes, in order.

    Args:
        processes: processes that evaluate bodies; None for one per core.
    """
    if processes == 1:
        yield lambda jobs: list(itertools.starmap(evaluate, jobs))
        return
    # The parent answers Ctrl-C, which its processes inherit to ignore. They are spawned, not forked: a fork would share
    # whatever OpenGL or threads the caller has open.
    interrupt_handler = signal.signal(signal.SIGINT, signal.SIG_IGN)
    pool = multiprocessing.get_context("spawn").Pool(processes)
    signal.signal(signal.SIGINT, interrupt_handler)
    with pool:
        yield lambda jobs: pool.starmap(evaluate, jobs, chunksize=1)


def search_settings(trial: Trial, cell_map: Map, around: Body | None) -> dict[str, Any]:
    """Return the settings that determine a search, as JSON holds them: with lists in place of tuples."""
    settings = {
        "task": trial.task,
        "goal": trial.goal,
        "budget": trial.budget._asdict(),
        "first": trial.first._asdict(),
        "second": trial.second._asdict(),
        "map": cell_map._asdict(),
        "around": None if around is None else body_to_json(around),
        "amount": None if around is None else FLAGS.amount,
        "seed": FLAGS.seed,
        "random": FLAGS.random,
        "versions": versions.dependency_versions(),
    }
    return json.loads(json.dumps(settings))


def run_search(folder: pathlib.Path, search: Search, settings: Mapping[str, Any]) -> None:
    """Start or continue a search, behind a progress bar.

    Args:
        folder: folder of the journal.
        search: without bodies; gets those of the journal, and new bodies.
        settings: settings that determine the search.
    """
    with contextlib.closing(Journal(folder / "journal.jsonl", settings, Candidates.from_json)) as journal:
        for batch in journal.generations:
            search.add(batch)
        finished_batches = len(journal.generations)
        batches = math.ceil(FLAGS.bodies / BATCH_SIZE)
        if finished_batches >= batches:
            return
        say(f"{folder}: {BATCH_SIZE * batches} bodies")
        with (
            open_evaluators(FLAGS.processes) as evaluate_all,
            progress(
                total=BATCH_SIZE * batches, initial=BATCH_SIZE * finished_batches, desc=FLAGS.goal, unit="body"
            ) as bar,
        ):
            for _ in range(finished_batches, batches):
                journal.append(search.evaluate_batch(evaluate_all))
                bar.set_postfix_str(f"{len(search.elites)} cells", refresh=False)
                bar.update(BATCH_SIZE)


def main() -> None:
    """Search, write the files and print a row for each cell."""
    prepare_jax()
    if not FLAGS.output:
        raise ValueError("no folder to write to; say --output=FOLDER")
    outputs.check_folders("output")
    goal = goal_of(FLAGS.goal)
    around = None if FLAGS.around is None else registry.body_of(FLAGS.around)
    if around is None:
        refuse_flags(["amount"], "goes with --around")
        space = ProportionGenes()
        default_axes = ("legs", "links")
        stem = "design"
    else:
        space = VariantGenes(around, FLAGS.amount)
        default_axes = ("height", "width")
        stem = around.name[:_MAX_STEM]
    cell_map = Map.of(FLAGS.map or default_axes, around, FLAGS.amount)
    task = FLAGS.task or goal.task
    task_settings = named_values("set", FLAGS["set"].value)
    trial = Trial.of(task, task_settings, FLAGS.goal, budget_from_flags(around), FLAGS.steps)
    search = Search(space, cell_map, trial, FLAGS.seed, stem, FLAGS.random)
    check_one_step(trial, cell_map, search.middle_body())
    if FLAGS.pages:
        pages.viewer_script()  # raises an error now if there is no viewer
    folder = files.folder(FLAGS.output)
    settings = search_settings(trial, cell_map, around)
    with resumable(folder):
        run_search(folder, search, settings)
    write_results(folder, search, cell_map, trial, settings)
    print(f"wrote {folder}")


def write_results(
    folder: pathlib.Path, search: Search, cell_map: Map, trial: Trial, settings: Mapping[str, Any]
) -> None:
    """Write the files of a search and print a row for each cell.

    Raises:
        ValueError: no cell has a body.
    """
    elites = gallery.find_elites(search, cell_map)
    gallery.write_table(folder / "bodies.csv", search, cell_map)
    gallery.write_specs(folder / "bodies", elites)
    with files.writing_json(folder / "design.json") as report:
        report.update(settings, bodies=len(search.candidates), elites=[elite.to_dict() for elite in elites])
    if not elites:
        reasons = collections.Counter(candidate.outcome.reason.split(":")[0] for candidate in search.candidates)
        [(most_common_reason, _)] = reasons.most_common(1)
        raise ValueError(f"none of {len(search.candidates)} bodies counts; most often: {most_common_reason}")
    print_table(elites, trial)
    pictures = gallery.draw_pictures(progress(elites, "rendering", unit="body"), cell_map, trial)
    gallery.write_picture(folder / "gallery.png", pictures)
    if FLAGS.pages:
        gallery.write_walks(folder / "walks", progress(elites, "walking", unit="body"), cell_map, trial)
        gallery.write_page(folder / "gallery.html", pictures, cell_map, f"{trial.goal} in {trial.task}")


def check_one_step(trial: Trial, cell_map: Map, body: Body | str) -> None:
    """Find the cell of one body and let it take a step, to find errors before the search.

    Args:
        trial: trial of the search.
        cell_map: map of the search.
        body: body to try, or the reason why there is no body.

    Raises:
        ValueError: no body within the budget, a setting that does not fit, or a task that does not measure the metric.
    """
    if isinstance(body, str):
        raise ValueError(body)
    cell_map.cell(body)
    goal = goal_of(trial.goal)
    measure_walk(body, trial.task, trial.first._replace(steps=1), goal.preset)
    second_walk = measure_walk(body, trial.task, trial.second._replace(steps=1), goal.preset)
    if math.isnan(goal.value(second_walk)):
        raise ValueError(f"--goal={trial.goal}: task {trial.task} does not measure {goal.metric}")


def print_table(elites: Iterable[gallery.Elite], trial: Trial) -> None:
    """Print a row for each cell: its body, and the metric in both evaluations."""
    goal = goal_of(trial.goal)
    unit = goal.unit.replace(" ", ", ", 1)
    line = "{:<24} {:>6} {:>17} {:>15} {:>12}"
    print(line.format("cell", "body", f"{goal.metric_text}{unit}", "evaluated again", "power, W/kg"))
    for elite in elites:
        first = f"{goal.measure_metric(elite.first):.3f}"
        second = f"{goal.measure_metric(elite.second):.3f}"
        power = f"{elite.second.power:.1f}"
        print(line.format(elite.label, elite.number, first, second, power))
