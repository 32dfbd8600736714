"""Search the parameters of a robot's demonstrator with the highest return.

It must walk no worse than `medium` does. The search is CMA-ES on the vector environment. Broken off
at any moment, the same command goes on. At the end the best parameters are compared with the existing presets
over many resets, and printed as a row for the table of presets.

  python tools/tune_cpg.py --robot queen --output out/tune/queen
  python tools/tune_cpg.py --robot queen --space torques --output out/tune/queen-torques
"""

import contextlib
import pathlib

from absl import flags
from preset_search import Evaluator, Generation, Search
from preset_search.evaluator import STYLE
from preset_search.search import HARD
from preset_search.space import SPACES

from arc_suite import checks, evaluation, files, versions
from arc_suite.cli import program
from arc_suite.cli.flags import MAX_COUNT, define_task, task_from_flags
from arc_suite.cpg.prescribed import Preset
from arc_suite.cpg.presets import PRESETS
from arc_suite.envs.setup import Setup
from arc_suite.journal import Journal
from arc_suite.tasks.contract import STEPS

FLAGS = flags.FLAGS
define_task()
flags.DEFINE_string("robot", "queen", f"One of {', '.join(PRESETS)}.")
flags.DEFINE_string(
    "space", "law", "law: parameters of the paper's law, around `medium`; torques: added to it, around `tuned`."
)
for name, low, high, help_text in (
    ("generations", 1, MAX_COUNT, "Generations of the search, more make a finished one go on"),
    ("episodes", 1, MAX_COUNT, "Episodes by which a candidate is evaluated"),
    ("steps", 1, STEPS, "Control steps of these episodes"),
    ("starts", 0, MAX_COUNT, f"Starts; candidates are judged in the {HARD} hardest of them; 0 for none"),
):
    defaults = " and ".join(f"{getattr(kind, name)} for {space}" for space, kind in SPACES.items())
    flags.DEFINE_integer(name, None, f"{help_text}; {defaults} if not given.", low, high)
flags.DEFINE_integer("seed", 0, "Seed of the search.", 0, 1000)
flags.DEFINE_integer("resets", 100, "Episodes over which the result may not fall.", 1, MAX_COUNT)
flags.DEFINE_string(
    "output", "out/tune", "Folder of the journal, the plot and the result, made if need be.", short_name="o"
)


def flag_or_default(name: str) -> int:
    """Return the value of a flag, or the default of the space."""
    value = FLAGS[name].value
    return getattr(SPACES[FLAGS.space], name) if value is None else value


def search(setup: Setup, folder: pathlib.Path) -> tuple[Search, Journal]:
    """Search behind a progress bar, or go on."""
    settings = {name: FLAGS[name].value for name in ("space", "seed")}
    settings |= {name: flag_or_default(name) for name in ("episodes", "steps", "starts")}
    record = setup.to_dict() | settings | {"versions": versions.dependency_versions()}
    with contextlib.closing(Journal(folder / "journal.jsonl", record, Generation)) as journal:
        course = Search(setup, **settings)
        for generation in journal.generations:
            course.step(generation.fitness)
        first = len(journal.generations)
        count = flag_or_default("generations")
        program.say(f"{folder}: {count} generations")
        with program.progress(total=max(count, first), initial=first, desc=setup.name, unit="generation") as bar:
            for _ in range(first, count):
                journal.append(course.step())
                bar.set_postfix_str(f"return {STEPS * journal.generations[-1].reward:.0f}", refresh=False)
                bar.update()
    return course, journal


def evaluate(setup: Setup, preset: Preset) -> dict:
    """Return returns, falls and style over the resets: of the result, of the preset it started from, and of medium."""
    presets = {"found": preset}
    for name in (SPACES[FLAGS.space].preset, "medium"):
        presets[name] = PRESETS[setup.name][name]
    evaluator = Evaluator(setup, len(presets), FLAGS.resets, STEPS)
    score = evaluator(list(presets.values()), range(FLAGS.resets))
    metrics = {}
    for row, name in enumerate(presets):
        metrics[name] = {
            "return": evaluation.summary(STEPS * score.rewards[row]),
            "falls": int(score.falls[row].sum()),
            **{cost: float(values[row].mean()) for cost, values in score.style.items()},
        }
    return metrics


def violations(metrics: dict) -> list[str]:
    """Return the constraints that the result violates, a text for each."""
    result = metrics["found"]
    medium = metrics["medium"]
    texts = []
    for name in STYLE:
        if result[name] > medium[name]:
            texts.append(f"{name} {result[name]:.3f}, medium's {medium[name]:.3f}")
    if result["falls"] > 0:
        texts.append(f"{result['falls']} falls")
    return texts


def main() -> None:
    """Search, evaluate, print and write."""
    setup = Setup.of(FLAGS.robot, *task_from_flags())
    checks.name(setup.body.name, PRESETS, "robot with presets")
    checks.name(FLAGS.space, SPACES, "space")
    if 0 < (FLAGS.starts or 0) < HARD:
        raise ValueError(f"flag --starts={FLAGS.starts}: expected {HARD} or more, or 0")
    with versions.require_extra("a search needs cma and matplotlib", "dev"):
        import cma  # noqa: F401
        from preset_search import plots
    folder = files.folder(FLAGS.output)
    with files.writing_json(folder / "result.json") as file, files.writing(folder / "course.png") as picture:
        with program.resumable(folder):
            course, journal = search(setup, folder)
        preset = course.result()
        plots.course(setup.name, course.reward, journal.generations, STEPS).savefig(picture)
        metrics = evaluate(setup, preset)
        file.update(setup.to_dict(), space=FLAGS.space, seed=FLAGS.seed)
        file.update(generations=len(journal.generations), resets=FLAGS.resets)
        file.update(preset=preset, metrics=metrics, versions=versions.dependency_versions())
    columns = "{:<8} {:>18}" + " {:>12}" * (1 + len(STYLE))
    header = columns.format("preset", "return", f"falls of {FLAGS.resets}", *STYLE)
    print(header, "-" * len(header), sep="\n")
    for name, row in metrics.items():
        total = f"{row['return'].mean:.1f} +- {row['return'].deviation:.1f}"
        print(columns.format(name, total, row["falls"], *(f"{row[cost]:.3f}" for cost in STYLE)))
    print(f"\n{preset}")
    texts = violations(metrics)
    if texts:
        raise ValueError(f"the result breaks its constraints: {'; '.join(texts)}")


if __name__ == "__main__":
    program.run(main)
