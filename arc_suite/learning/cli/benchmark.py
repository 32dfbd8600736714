"""Run the benchmark: ten places, three divisions, a score.

A score is (return - standing still) / (best demonstrator - standing still). The division `top` gives an algorithm a
million steps, three on uneven ground and among pillars; `samples` gives it 100,000; `demonstrations` gives it 100,000,
and 100 episodes of a demonstrator. The runs of an algorithm on a division are a study: killed at any moment, the same
command resumes. Policies of other libraries are files ROBOT-TASK-SEED in a folder: .zip of stable-baselines3, .npz,
.py with a function make(robot), or folders of runs. Without a division the command prints the table of all learners.

  arc-suite benchmark samples --algorithm sac_parallel
  arc-suite benchmark top --algorithm ppo --seeds 2 --jobs 8
  arc-suite benchmark samples --algorithm sac --seeds 1 --places tick-walk,leaper-walk
  arc-suite benchmark samples --policies my_zips --name my_sac
"""

from pathlib import Path

from absl import flags

from arc_suite import checks, evaluation, files
from arc_suite.cli import outputs
from arc_suite.cli.flags import refuse_flags
from arc_suite.cli.program import progress, resumable, say
from arc_suite.learning.agents import run_folder
from arc_suite.learning.studies import benchmark, entries, publication, report, results, runner, tables
from arc_suite.learning.studies.divisions import DIVISIONS, PLACES, SEEDS
from arc_suite.simulation.cores import usable_cores

_PLACE_NAMES = [f"{robot}-{task}" for robot, task in PLACES]

FLAGS = flags.FLAGS
flags.DEFINE_string("algorithm", "ppo", "As in arc-suite train.")
flags.DEFINE_integer("seeds", SEEDS, "Number of seeds of each place: 2 are seeds 0 and 1.", 1, SEEDS)
flags.DEFINE_list("places", _PLACE_NAMES, "Places to run, ROBOT-TASK. [default: all ten]")
flags.DEFINE_integer("jobs", None, "Runs at a time. [default: as many as cores]", lower_bound=1)
flags.DEFINE_string("policies", None, "Folder of policies to score in place of runs.")
flags.DEFINE_string("name", None, "Of these policies in the table. [default: the name of the folder]")
flags.DEFINE_string("runs", files.RUNS_FOLDER, "Folder of the runs.")
flags.DEFINE_string("results", "studies", "Folder of the tables and reports.")

_FLAGS_OF_RUNS = ("algorithm", "seeds", "places", "jobs", "runs")


def main(division: str | None = None) -> int:
    """Run a division, and print the table; the exit status is 0 if no run has failed."""
    places = [checks.name(place, _PLACE_NAMES, "place") for place in FLAGS.places]
    status = 0
    _check_flags(division)
    outputs.check_folders("runs", "results")
    if division is not None:
        checks.name(division, DIVISIONS, "division")
        if FLAGS.policies:
            score_policies(division)
        else:
            status = run_division(division, places)
    results_folder = Path(FLAGS.results)
    if status and not benchmark.read(results_folder):  # all runs have failed: lines above say why
        return status
    print(benchmark.text(results_folder))
    return status


def _check_flags(division: str | None) -> None:
    """Raise ValueError for a flag that has no effect with the others."""
    if division is None:
        refuse_flags((*_FLAGS_OF_RUNS, "policies", "name"), "goes with a division, such as samples")
    elif FLAGS.policies:
        refuse_flags(_FLAGS_OF_RUNS, "goes without --policies, whose names have places and seeds")
    else:
        refuse_flags(["name"], "goes with --policies")


def run_division(division: str, places: list[str]) -> int:
    """Make the runs of the algorithm, write their report and scores, and return the exit status.

    Args:
        division: name of the division.
        places: places to run, ROBOT-TASK.

    Raises:
        ValueError: an algorithm that the division does not take, or a run of more steps than it gives.
    """
    study = tables.benchmark(division, FLAGS.algorithm)
    learner = tables.folder_name(FLAGS.algorithm)
    name = f"{division}-{learner}"
    folder = Path(FLAGS.runs, name)
    published = Path(FLAGS.results, name)
    files.check_folder(published)
    runs = [run for run in study.runs if _is_selected(run, places)]
    with resumable(folder):
        status = runner.make(runs, folder, FLAGS.jobs or usable_cores(), progress)
    for run in study.runs:  # before their policies are judged
        benchmark.check_budget(run, run_folder.read_progress(folder / run.name).get("evaluated", 0))
    publication.publish(study.runs, folder, published, progress)
    run_results = results.read_results(study.runs, published)
    if run_results:
        print(report.write(name, study, published))
        benchmark.write(published.parent, division, learner, benchmark.score_results(run_results))
    return status


def score_policies(division: str) -> None:
    """Judge the policies of a folder, and write their scores and their returns.

    Raises:
        ValueError: a name of other characters than letters, digits, `_`, `-` and `.`, or a folder that
            `entries.find_policies` or `entries.score_policies` refuses.
        OSError: a file cannot be read.
    """
    folder = Path(FLAGS.policies)
    name = FLAGS.name or folder.resolve().name
    benchmark.check_name(name)
    files.check_folder(FLAGS.results)
    paths_by_run = entries.find_policies(folder)
    size = SEEDS * len(PLACES)
    say(f"{folder}: {len(paths_by_run)} of the {size} policies of an entry, {evaluation.EPISODES} episodes each")
    judged = entries.score_policies(folder, paths_by_run, progress)
    studies = Path(FLAGS.results)
    lines_by_run = {policy.score.policy_name: policy.lines for policy in judged}
    publication.write_finals(studies / f"{division}-{name}", lines_by_run)
    benchmark.write(studies, division, name, [policy.score for policy in judged])


def _is_selected(run: tables.Run, places: list[str]) -> bool:
    """Return whether the flags select the seed and the place of a run."""
    setup = run.configuration.setup
    place = f"{setup.body.name}-{setup.kind.name}"
    return run.configuration.seed < FLAGS.seeds and place in places
