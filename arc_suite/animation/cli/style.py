"""Measure the style of a walk: gait, course, torso, joints and effort.

  arc-suite style --robot queen --policy cpg --preset medium
  arc-suite style --policy my_package.policies:make --compare cpg --output out/style
  arc-suite style --spec spider --save out/spider.npz
  arc-suite style --policy out/spider.npz --compare zero
  arc-suite style --policy arc_suite/queen/walk/cpg-medium-v0 --compare arc_suite/queen/walk/random-v0

`--output` writes gait.png, reward.png, speed.png and path.png of the first episode; no gait.png where
the task prescribes no gait. `--page` writes a page that plays it, and the one it is compared with, in any
browser. What every metric means is written in arc_suite/style/metrics.py.
"""

import contextlib
import math
import pathlib

from absl import flags

from arc_suite import evaluation, files, style, versions
from arc_suite.animation import pages
from arc_suite.cli.flags import (
    MOST,
    ROBOT_HELP,
    bodies,
    define_body,
    define_policy,
    define_preset,
    define_task,
    policy_name,
    setups,
    task,
)
from arc_suite.cli.program import progress
from arc_suite.style import sources

FLAGS = flags.FLAGS
define_body()
define_task()
_ROBOT = flags.DEFINE_string("robot", "queen", f"{ROBOT_HELP}, or all. [default: the one of stored tracks, else queen]")
define_policy(sources.HELP)
define_preset()
flags.DEFINE_string("compare", None, "A second policy, file or dataset to compare with.")
flags.DEFINE_string("compare_preset", None, "Preset of --compare, if that is the cpg. [default: as of --preset]")
flags.DEFINE_integer("episodes", evaluation.EPISODES, "How many episodes; of stored ones, at most.", 1, MOST)
flags.DEFINE_integer("seed", 0, "Seed of the first episode; the others count on from it.", lower_bound=0)
flags.DEFINE_string("json", None, "File to write the metrics to, as JSON.")
flags.DEFINE_string(
    "output",
    None,
    "Folder to write pictures to, made if need be; of several robots, a folder in it for each.",
    short_name="o",
)
flags.DEFINE_string("page", None, "File to write a page to that plays the first episodes side by side (.html).")
flags.DEFINE_string("save", None, "File to save the tracks of --policy to (.npz).")


def chosen_sources() -> dict[str, style.Source]:
    """Return the sources of the columns, by label."""
    first = style.source(policy_name(FLAGS.policy), FLAGS.preset)
    if FLAGS.compare is None:
        return {first.label: first}
    second = style.source(FLAGS.compare, FLAGS.compare_preset)
    if first.label != second.label:
        return {first.label: first, second.label: second}
    if FLAGS.policy == FLAGS.compare:
        raise ValueError(f"--compare: expected another one than {first.label!r}")
    return {FLAGS.policy: first, FLAGS.compare: second}  # files of one name in two folders


def number(value: float, decimals: int = 3) -> str:
    """Return a number as text; a dash for NaN."""
    return "-" if math.isnan(value) else f"{value:.{decimals}f}"


def spread(summary: evaluation.Summary) -> str:
    """Return mean +- standard deviation as text, the mean alone where it is not finite."""
    if not math.isfinite(summary.mean):
        return number(summary.mean)
    decimals = 1 if abs(summary.mean) >= 100.0 else 3
    return f"{number(summary.mean, decimals)} +- {number(summary.deviation, decimals)}"


def print_table(heading: str, columns: list[str], rows: list[tuple[str, dict, list[str]]]) -> None:
    """Print rows of a name, a metric, and a cell for each column."""
    width = max(8, *(len(text) for text in [*columns, *(cell for _, _, cells in rows for cell in cells)]))
    first = max(18, len(heading))
    line = f"{{:<{first}}} {{:<8}} {{:>10}}" + f"  {{:>{width}}}" * len(columns)
    header = line.format(heading, "unit", "prescribed", *columns)
    print("", header, "-" * len(header), sep="\n")
    for name, metric, cells in rows:
        prescribed = metric.get("prescribed")
        prescribed = "" if prescribed is None else number(prescribed)
        print(line.format(name.replace("_", " "), metric.get("unit", ""), prescribed, *cells))


def print_report(robot: str, reports: dict) -> None:
    """Print the tables of one robot: its own metrics, policies side by side, then those of the legs for each policy."""
    first = next(iter(reports.values()))
    rows = [(name, {}, [spread(r[name]) for r in reports.values()]) for name in ("return", "length")]
    others = [name for name in first["progress"] if name not in first["metrics"]]
    rows += [(name, {}, [spread(r["progress"][name]) for r in reports.values()]) for name in others]
    rows += [
        (name, metric, [spread(r["metrics"][name]["robot"]) for r in reports.values()])
        for name, metric in first["metrics"].items()
    ]
    print_table(robot, list(reports), rows)
    for label, metrics in reports.items():
        rows = [
            (name, metric, [number(summary.mean) for summary in metric["legs"].values()])
            for name, metric in metrics["metrics"].items()
            if metric["legs"]
        ]
        print_table(f"{robot}, {label}", list(first["metrics"]["foot_slip"]["legs"]), rows)


@contextlib.contextmanager
def pictures(robots: list[str]):
    """Yields a function that writes the pictures of a robot's tracks by label; does nothing without `--output`."""
    if FLAGS.output is None:
        yield lambda robot, tracks: None
        return
    try:
        from arc_suite.animation.style_plots import OF_GAIT, PICTURES
    except ImportError as error:
        raise versions.MissingExtra("pictures need matplotlib", "animate", error) from None
    with contextlib.ExitStack() as stack:
        targets = {}
        for robot in robots:
            folder = files.folder(pathlib.Path(FLAGS.output, robot if len(robots) > 1 else ""))
            targets[robot] = {name: stack.enter_context(files.writing(folder / f"{name}.png")) for name in PICTURES}

        def draw(robot, tracks):
            gaits = all(track.parameters is not None for track in tracks.values())
            for name, file in targets[robot].items():
                if name in OF_GAIT and not gaits:
                    file.unlink()  # so that nothing is written
                else:
                    PICTURES[name](tracks).savefig(file)

        yield draw


@contextlib.contextmanager
def playing():
    """Yields a dictionary to fill with tracks by label, which the page plays side by side; ignored without `--page`."""
    if FLAGS.page is None:
        yield {}
        return
    if not FLAGS.page.endswith(".html"):
        raise ValueError(f"--page={FLAGS.page}: expected a file that ends in .html")
    pages.viewer()  # finds out at once whether there is one
    with files.writing(FLAGS.page) as file:
        tracks = {}
        yield tracks
        file.write_text(pages.page(tracks), encoding="utf-8")


@contextlib.contextmanager
def saving(robots: list[str]):
    """Yields a function that saves tracks; does nothing without `--save`."""
    if FLAGS.save is None:
        yield lambda tracks: None
        return
    if not FLAGS.save.endswith(".npz"):
        raise ValueError(f"--save={FLAGS.save}: expected a file that ends in .npz")
    if len(robots) > 1:
        raise ValueError(f"--save={FLAGS.save}: expected one robot, got {', '.join(robots)}")
    with files.writing(FLAGS.save) as file:
        yield lambda tracks: style.save(file, tracks)


def main() -> None:
    """Record, measure, print and write."""
    bodies(_ROBOT), task()  # first: this imports the modules that flags name, which files cannot import
    chosen = chosen_sources()
    chosen_for = setups(_ROBOT, next((source.setup for source in chosen.values() if source.setup), None))
    seeds = range(FLAGS.seed, FLAGS.seed + FLAGS.episodes)
    recorders = {
        robot: {label: source.recorders(setup, seeds) for label, source in chosen.items()}
        for robot, setup in chosen_for.items()
    }
    robots = list(recorders)
    with (
        files.writing_json(FLAGS.json) as file,
        pictures(robots) as draw,
        playing() as played,
        saving(robots) as save,
    ):
        reports = {}
        for robot, by_label in recorders.items():
            tracks = {}
            for label, several in by_label.items():
                with progress(several, desc=f"{robot}, {label}", unit="episode", leave=False) as bar:
                    tracks[label] = [recorder() for recorder in bar]
            save(next(iter(tracks.values())))
            reports[robot] = {label: style.report(recorded) for label, recorded in tracks.items()}
            print_report(robot, reports[robot])
            firsts = {f"{robot}, {label}": recorded[0] for label, recorded in tracks.items()}
            draw(robot, firsts)
            played.update(firsts)
        setup = next(iter(chosen_for.values()))
        file.update(
            task=setup.task,
            task_kwargs=setup.task_kwargs,
            episodes=FLAGS.episodes,
            seed=FLAGS.seed,
            robots=reports,
            versions=versions.recorded(),
        )
