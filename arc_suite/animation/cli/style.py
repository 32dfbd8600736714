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
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from absl import flags

from arc_suite import checks, evaluation, files, style, versions
from arc_suite.animation import pages
from arc_suite.cli import outputs
from arc_suite.cli.flags import (
    MAX_COUNT,
    bodies_from_flags,
    define_walk,
    policy_name,
    preset_from_flags,
    refuse_flags,
    setups_from_flags,
    task_from_flags,
)
from arc_suite.cli.program import progress
from arc_suite.cli.summary import transport_footnote
from arc_suite.envs.setup import Setup
from arc_suite.style import sources

FLAGS = flags.FLAGS
define_walk(more=", or all; without it, the one of stored tracks", policy=sources.HELP)
flags.DEFINE_string("compare", None, "A second policy, file or dataset to compare with.")
flags.DEFINE_string(
    "compare_preset", None, "Preset of --compare, if that is cpg. [default: the one that suits the task and the body]"
)
flags.DEFINE_integer(
    "episodes",
    evaluation.CURVE_EPISODES,
    "How many episodes; of stored ones, at most.",
    lower_bound=1,
    upper_bound=MAX_COUNT,
)
flags.DEFINE_integer("seed", 0, "Seed of the first episode; the others count on from it.", lower_bound=0)
flags.DEFINE_string("json", None, "File to write the metrics to, as JSON.")
flags.DEFINE_string("output", None, "Folder of pictures; of several robots, a folder in it for each.", short_name="o")
flags.DEFINE_string("page", None, "File to write a page to that plays the first episodes side by side (.html).")
flags.DEFINE_string("save", None, "File to save the tracks of --policy to (.npz).")


def main() -> None:
    """Record, measure, print and write."""
    # First: these import the modules that flags name, which files cannot import.
    bodies_from_flags()
    task_from_flags()
    sources_by_label = find_sources()
    if all(source.setup for source in sources_by_label.values()):
        refuse_flags(["seed"], "expected none, as stored tracks have their seeds")
    setups = setups_from_flags(find_stored_setup(sources_by_label))
    seeds = range(FLAGS.seed, FLAGS.seed + FLAGS.episodes)
    recorders_by_robot = {
        robot: {label: source.recorders(setup, seeds) for label, source in sources_by_label.items()}
        for robot, setup in setups.items()
    }
    draw_pictures = load_picture_functions() if FLAGS.output else None
    robots = list(setups)
    check_files(robots)
    reports = {}
    first_tracks = {}  # by labels of the page
    with contextlib.ExitStack() as stack:
        json_content = stack.enter_context(files.writing_json(FLAGS.json))
        page_path = stack.enter_context(files.writing(FLAGS.page)) if FLAGS.page else None
        tracks_path = stack.enter_context(files.writing(FLAGS.save)) if FLAGS.save else None
        for robot in robots:
            tracks_by_label = record_tracks(robot, recorders_by_robot[robot])
            reports[robot] = {label: style.report(tracks) for label, tracks in tracks_by_label.items()}
            print_report(robot, reports[robot])
            robot_first_tracks = {f"{robot}, {label}": tracks[0] for label, tracks in tracks_by_label.items()}
            first_tracks |= robot_first_tracks
            if tracks_path:
                first_label = next(iter(tracks_by_label))
                style.save(tracks_path, tracks_by_label[first_label])
            if draw_pictures:
                folder = pathlib.Path(FLAGS.output, robot if len(robots) > 1 else "")
                draw_pictures(folder, robot_first_tracks)
        footnote = transport_footnote(setup.body for setup in setups.values())
        if footnote:
            print(footnote)
        if page_path:
            page_path.write_text(pages.page(first_tracks), encoding="utf-8")
        any_setup = setups[robots[0]]  # all have the same task
        json_content.update(
            task=any_setup.task,
            task_kwargs=any_setup.task_kwargs,
            robots=reports,
            versions=versions.dependency_versions(),
        )


def find_sources() -> dict[str, style.Source]:
    """Return the sources of tracks that --policy and --compare name, by label of their columns."""
    first = style.source(policy_name(FLAGS.policy), preset_from_flags())
    if FLAGS.compare is None:
        refuse_flags(["compare_preset"], "goes with --compare=cpg")
        return {first.label: first}
    if FLAGS.compare_preset is not None and FLAGS.compare != "cpg":
        raise ValueError(
            f"--compare_preset={checks.quote(FLAGS.compare_preset)}: goes with --compare=cpg, "
            f"got {checks.preview(FLAGS.compare)}"
        )
    second = style.source(FLAGS.compare, FLAGS.compare_preset)
    if first.label != second.label:
        return {first.label: first, second.label: second}
    if FLAGS.policy == FLAGS.compare:
        raise ValueError(f"--compare: expected another one than {first.label!r}")
    return {FLAGS.policy: first, FLAGS.compare: second}  # files of one name in two folders


def find_stored_setup(sources_by_label: Mapping[str, style.Source]) -> Setup | None:
    """Return the setup of the first source that has stored tracks; None if no source has any."""
    for source in sources_by_label.values():
        if source.setup:
            return source.setup
    return None


def check_files(robots: list[str]) -> None:
    """Check before recording that the files of flags can be made.

    Raises:
        ValueError: another extension, several robots to save, or no viewer of pages.
        OSError: the folder of pictures cannot be made.
    """
    outputs.check_json(FLAGS.json)
    outputs.check_folders("output")
    for flag, extension in (("page", ".html"), ("save", ".npz")):
        path = FLAGS[flag].value
        if path is not None and not path.lower().endswith(extension):
            raise ValueError(f"--{flag}={path}: expected a file that ends in {extension}")
    if FLAGS.save is not None and len(robots) > 1:
        raise ValueError(f"--save={FLAGS.save}: expected one robot, got {', '.join(robots)}")
    if FLAGS.page is not None:
        pages.viewer_script()
    if FLAGS.output is not None:
        files.folder(FLAGS.output)


def record_tracks(robot: str, recorders_by_label: Mapping[str, list[Callable]]) -> dict[str, list[style.Track]]:
    """Return the tracks of one robot by label, recorded behind progress bars."""
    tracks_by_label = {}
    for label, recorders in recorders_by_label.items():
        with progress(recorders, desc=f"{robot}, {label}", unit="episode", leave=False) as bar:
            tracks_by_label[label] = [record() for record in bar]
    return tracks_by_label


def load_picture_functions() -> Callable[[pathlib.Path, dict], None]:
    """Return a function that draws tracks by label into a folder.

    Raises:
        ValueError: matplotlib is not installed.
    """
    with versions.require_extra("pictures need matplotlib", "animate"):
        from arc_suite.animation.style_plots import GAIT_PICTURES, PICTURES

    def draw_pictures(folder, tracks_by_label):
        all_have_gaits = all(track.parameters is not None for track in tracks_by_label.values())
        names = PICTURES if all_have_gaits else PICTURES.keys() - GAIT_PICTURES
        for name in names:
            with files.writing(files.folder(folder) / f"{name}.png") as file:
                PICTURES[name](tracks_by_label).savefig(file)

    return draw_pictures


class TableLine(NamedTuple):
    """A line of a table.

    Attributes:
        name: name of a metric.
        metric: with its `unit` and the value `prescribed`, if it has them; see `style.report`.
        cells: one for each column.
    """

    name: str
    metric: Mapping[str, Any]
    cells: list[str]


def print_report(robot: str, reports: Mapping[str, Mapping[str, Any]]) -> None:
    """Print the tables of one robot: a table that compares policies, then a table of the legs for each policy.

    Args:
        robot: its name.
        reports: reports of `style.report`, by label of the policy.
    """
    print_table(robot, list(reports), _robot_lines(list(reports.values())))
    for label, report in reports.items():
        names = [name for name, metric in report["metrics"].items() if math.isinf(metric["robot"].mean)]
        if names:
            print(f"{label}: {', '.join(names).replace('_', ' ')}: -, as the robot gets nowhere")
    first_report = next(iter(reports.values()))
    leg_names = list(first_report["metrics"]["foot_slip"]["legs"])
    for label, report in reports.items():
        lines = []
        for name, metric in report["metrics"].items():
            if metric["legs"]:
                cells = [format_number(summary.mean) for summary in metric["legs"].values()]
                lines.append(TableLine(name, metric, cells))
        print_table(f"{robot}, {label}", leg_names, lines)


def _robot_lines(reports: list[Mapping[str, Any]]) -> list[TableLine]:
    """Return the lines of a table with a column for each report: return, length, the task's metrics, style metrics."""
    first_report = reports[0]
    lines = []
    for name in ("return", "length"):
        lines.append(TableLine(name, {}, [format_summary(report[name]) for report in reports]))
    for name in first_report["progress"]:
        if name not in first_report["metrics"]:
            lines.append(TableLine(name, {}, [format_summary(report["progress"][name]) for report in reports]))
    for name, metric in first_report["metrics"].items():
        cells = [format_summary(report["metrics"][name]["robot"]) for report in reports]
        lines.append(TableLine(name, metric, cells))
    return lines


def print_table(heading: str, columns: list[str], lines: list[TableLine]) -> None:
    """Print a table.

    Args:
        heading: heading of the first column.
        columns: headings of the columns of cells.
        lines: lines of the table.
    """
    texts = [*columns, *(cell for line in lines for cell in line.cells)]
    cell_width = max(8, *(len(text) for text in texts))
    name_width = max(18, len(heading))
    template = f"{{:<{name_width}}} {{:<8}} {{:>10}}" + f"  {{:>{cell_width}}}" * len(columns)
    header = template.format(heading, "unit", "prescribed", *columns)
    print("", header, "-" * len(header), sep="\n")
    for name, metric, cells in lines:
        prescribed_value = metric.get("prescribed")
        prescribed = "" if prescribed_value is None else format_number(prescribed_value)
        print(template.format(name.replace("_", " "), metric.get("unit", ""), prescribed, *cells))


def format_number(value: float, decimals: int = 3) -> str:
    """Return a number as text; a dash for what is undefined, or for an amount a meter of a body that gets nowhere."""
    return f"{value:.{decimals}f}" if math.isfinite(value) else "-"


def format_summary(summary: evaluation.Summary) -> str:
    """Return mean +- standard deviation as text, only the mean if it is not finite."""
    if not math.isfinite(summary.mean):
        return format_number(summary.mean)
    decimals = 1 if abs(summary.mean) >= 100.0 else 3
    return f"{format_number(summary.mean, decimals)} +- {format_number(summary.deviation, decimals)}"
