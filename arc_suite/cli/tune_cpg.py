"""Searches the demonstrator's numbers of a robot that earn most, walking no worse than `medium` does.

The search is CMA-ES on the vector environment. Broken off at any moment, the same command goes on.
At the end the best numbers are judged beside `medium` over many resets and printed as a row for the
table of presets.

  python tools/tune_cpg.py --robot queen --output out/tune/queen
"""

import contextlib
import pathlib

from absl import flags
from tqdm import tqdm

from arc_suite import checks, evaluation, files, versions
from arc_suite.cli import program
from arc_suite.cpg.presets import TUNINGS, Preset
from arc_suite.robots import ROBOTS
from arc_suite.tasks.walk import HORIZON
from arc_suite.tuning import Journal, Judge, Search
from arc_suite.tuning.judge import STYLE
from arc_suite.tuning.search import HARD

FLAGS = flags.FLAGS
flags.DEFINE_string("robot", "queen", f"One of {', '.join(TUNINGS)}.")
flags.DEFINE_integer("generations", 250, "Of the search; more make a finished one go on.", lower_bound=1)
flags.DEFINE_integer("episodes", 2, "By which a candidate is judged.", lower_bound=1)
flags.DEFINE_integer("steps", 300, "Control steps of these.", 1, HORIZON)
flags.DEFINE_integer("starts", 1000, "Of which candidates are tried in the hardest.", lower_bound=HARD)
flags.DEFINE_integer("seed", 0, "Of the search.", 0, 1000)
flags.DEFINE_integer("resets", 100, "Episodes over which the result may not fall.", lower_bound=1)
flags.DEFINE_string("output", "out/tune", "Folder of the journal, the plot and the result; it is made if need be.")


def search(folder: pathlib.Path) -> tuple[Search, Journal]:
    """Searches behind a progress bar, or goes on."""
    settings = {name: FLAGS[name].value for name in ("robot", "seed", "episodes", "steps", "starts")}
    with contextlib.closing(Journal(folder / "journal.jsonl", settings | {"versions": versions.recorded()})) as journal:
        try:
            course = Search(**settings)
        except ImportError as error:
            raise ValueError(f"a search needs cma: pip install 'arc_suite[tune]' ({error})") from None
        for generation in journal.generations:
            course.step(generation.fitness)
        done = len(journal.generations)
        with tqdm(total=max(FLAGS.generations, done), initial=done, desc=FLAGS.robot, unit="generation") as bar:
            for _ in range(done, FLAGS.generations):
                journal.append(course.step())
                bar.set_postfix_str(f"return {HORIZON * journal.generations[-1].reward:.0f}")
                bar.update()
    return course, journal


def judge(preset: Preset) -> dict:
    """Return, falls and style over the resets, of the result and of medium."""
    body = ROBOTS[FLAGS.robot]
    presets = {"tuned": preset, "medium": TUNINGS[FLAGS.robot]["medium"]}
    score = Judge(body, len(presets), FLAGS.resets, HORIZON)(list(presets.values()), range(FLAGS.resets))
    return {
        name: {"return": evaluation.summary(HORIZON * score.rewards[row]), "falls": int(score.falls[row].sum())}
        | {cost: float(values[row].mean()) for cost, values in score.style.items()}
        for row, name in enumerate(presets)
    }


def violations(figures: dict) -> list[str]:
    """In what the result is not as good as it must be."""
    tuned, medium = figures["tuned"], figures["medium"]
    worse = [f"{name} {tuned[name]:.3f}, medium's {medium[name]:.3f}" for name in STYLE if tuned[name] > medium[name]]
    return worse + [f"{tuned['falls']} falls"] * bool(tuned["falls"])


def main():
    """Searches, judges, prints and writes."""
    checks.name(FLAGS.robot, TUNINGS, "robot")
    try:
        from arc_suite.tuning import plots
    except ImportError as error:
        raise ValueError(f"the plot needs matplotlib: pip install 'arc_suite[plot]' ({error})") from None
    folder = files.folder(FLAGS.output)
    with files.writing_json(folder / "result.json") as file, files.writing(folder / "course.png") as picture:
        course, journal = search(folder)
        preset = course.result()
        plots.course(FLAGS.robot, course.reward, journal.generations, HORIZON).savefig(picture)
        figures = judge(preset)
        file.update(
            robot=FLAGS.robot,
            seed=FLAGS.seed,
            generations=len(journal.generations),
            resets=FLAGS.resets,
            preset=preset,
            figures=figures,
            versions=versions.recorded(),
        )
    columns = "{:<8} {:>18}" + " {:>12}" * (1 + len(STYLE))
    header = columns.format("preset", "return", f"falls of {FLAGS.resets}", *STYLE)
    print(header, "-" * len(header), sep="\n")
    for name, row in figures.items():
        total = f"{row['return'].mean:.1f} +- {row['return'].deviation:.1f}"
        print(columns.format(name, total, row["falls"], *(f"{row[cost]:.3f}" for cost in STYLE)))
    print(f"\n{preset}")
    if broken := violations(figures):
        raise ValueError(f"the result breaks its constraints: {'; '.join(broken)}")


if __name__ == "__main__":
    program.run(main)
