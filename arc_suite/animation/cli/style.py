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
from collections.abc import Callable

from absl import flags

from arc_suite import evaluation, files, style, versions
from arc_suite.animation import pages
from arc_suite.cli.flags import (
    MAX_COUNT,
    bodies_from_flags,
    define_walk,
    policy_name,
    setups_from_flags,
    task_from_flags,
)
from arc_suite.cli.program import progress
from arc_suite.cli.summary import transport_footnote
from arc_suite.style import sources

FLAGS = flags.FLAGS
define_walk(more=", or all; without it, the one of stored tracks", policy=sources.HELP)
flags.DEFINE_string("compare", None, "A second policy, file or dataset to compare with.")
flags.DEFINE_string("compare_preset", None, "Preset of --compare, if that is cpg. [default: as of --preset]")
flags.DEFINE_integer("episodes", evaluation.CURVE_EPISODES, "How many episodes; of stored ones, at most.", 1, MAX_COUNT)
flags.DEFINE_integer("seed", 0, "Seed of the first episode; the others count on from it.", lower_bound=0)
flags.DEFINE_string("json", None, "File to write the metrics to, as JSON.")
flags.DEFINE_string("output", None, "Folder of pictures; of several robots, a folder in it for each.", short_name="o")
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


def pictures() -> Callable[[pathlib.Path, dict], None]:
    """Return a function that draws tracks by label into a folder.

    Raises:
        ValueError: matplotlib is not installed.
    """
    with versions.require_extra("pictures need matplotlib", "animate"):
        from arc_suite.animation.style_plots import GAIT_PICTURES, PICTURES

    def draw(folder, tracks):
        gaits = all(track.parameters is not None for track in tracks.values())
        for name in PICTURES if gaits else PICTURES.keys() - GAIT_PICTURES:
            with files.writing(files.folder(folder) / f"{name}.png") as file:
                PICTURES[name](tracks).savefig(file)

    return draw


def check_files(robots: list[str]) -> None:
    """Find out at once whether the files of flags can be made.

    Raises:
        ValueError: another extension, several robots to save, or no viewer of pages.
        OSError: the folder of pictures cannot be made.
    """
    for flag, extension in (("page", ".html"), ("save", ".npz")):
        if (path := FLAGS[flag].value) is not None and not path.endswith(extension):
            raise ValueError(f"--{flag}={path}: expected a file that ends in {extension}")
    if FLAGS.save is not None and len(robots) > 1:
        raise ValueError(f"--save={FLAGS.save}: expected one robot, got {', '.join(robots)}")
    if FLAGS.page is not None:
        pages.viewer_script()
    if FLAGS.output is not None:
        files.folder(FLAGS.output)


def main() -> None:
    """Record, measure, print and write."""
    bodies_from_flags(), task_from_flags()  # first: this imports the modules that flags name, which files cannot import
    chosen = chosen_sources()
    chosen_for = setups_from_flags(next((source.setup for source in chosen.values() if source.setup), None))
    seeds = range(FLAGS.seed, FLAGS.seed + FLAGS.episodes)
    recorders = {
        robot: {label: source.recorders(setup, seeds) for label, source in chosen.items()}
        for robot, setup in chosen_for.items()
    }
    draw = FLAGS.output and pictures()
    check_files(list(recorders))
    reports, played = {}, {}
    with contextlib.ExitStack() as stack:
        file = stack.enter_context(files.writing_json(FLAGS.json))
        page, saved = (path and stack.enter_context(files.writing(path)) for path in (FLAGS.page, FLAGS.save))
        for robot, by_label in recorders.items():
            tracks = {}
            for label, several in by_label.items():
                with progress(several, desc=f"{robot}, {label}", unit="episode", leave=False) as bar:
                    tracks[label] = [recorder() for recorder in bar]
            reports[robot] = {label: style.report(recorded) for label, recorded in tracks.items()}
            print_report(robot, reports[robot])
            firsts = {f"{robot}, {label}": recorded[0] for label, recorded in tracks.items()}
            played |= firsts
            if saved:
                style.save(saved, next(iter(tracks.values())))
            if draw:
                draw(pathlib.Path(FLAGS.output, robot if len(recorders) > 1 else ""), firsts)
        if text := transport_footnote(setup.body for setup in chosen_for.values()):
            print(text)
        if page:
            page.write_text(pages.page(played), encoding="utf-8")
        setup = next(iter(chosen_for.values()))
        named = {"task": setup.task, "task_kwargs": setup.task_kwargs, "episodes": FLAGS.episodes, "seed": FLAGS.seed}
        file.update(named, robots=reports, versions=versions.dependency_versions())
