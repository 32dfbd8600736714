"""Judges how a policy walks: gait, course, torso, joints and effort, for the robot and for each leg.

Examples:
  python tools/style.py --robot queen --policy cpg --preset medium
  python tools/style.py --robot queen --policy my_package.policies:make --compare cpg --output out/style

`--output` writes gait.png, reward.png, speed.png and path.png of the first episode. What every
metric means is written in arc_suite/style/metrics.py.
"""

import contextlib
import math

from absl import flags
from tqdm import tqdm

import arc_suite
from arc_suite import commands, evaluation, policies, style

FLAGS = flags.FLAGS
flags.DEFINE_string("robot", "queen", "queen, bastion, tick or leaper.")
flags.DEFINE_string("policy", "cpg", policies.HELP)
flags.DEFINE_string("preset", "medium", "Of the cpg: slow, medium or fast.")
flags.DEFINE_string("compare", None, "A second policy, shown beside the first.")
flags.DEFINE_string("compare_preset", "medium", "Of the second policy, if that is the cpg.")
flags.DEFINE_integer("episodes", evaluation.EPISODES, "How many episodes.", lower_bound=1)
flags.DEFINE_integer("seed", 0, "Seed of the first episode; the others count on from it.", lower_bound=0)
flags.DEFINE_string("json", None, "File to write the figures to, as JSON.")
flags.DEFINE_string("output", None, "Folder to write pictures to; it is made if need be.")


def record(label: str, policy) -> list[style.Track]:
    """Records the episodes of a policy behind a progress bar."""
    environment = arc_suite.load(FLAGS.robot, "walk")
    with tqdm(range(FLAGS.seed, FLAGS.seed + FLAGS.episodes), desc=label, unit="episode", leave=False) as seeds:
        return [style.record(environment, policy, seed) for seed in seeds]


def report(tracks: list[style.Track]) -> dict:
    """The figures of a policy, as they go into the JSON."""
    measured = [style.measure(track) for track in tracks]
    summaries = {
        name: {
            "unit": metric.unit,
            "robot": evaluation.summary([measurement[name].value for measurement in measured]),
            "legs": {
                leg: evaluation.summary([measurement[name].legs[leg] for measurement in measured])
                for leg in measured[0][name].legs
            },
        }
        for name, metric in style.METRICS.items()
    }
    return {
        "return": evaluation.summary([track.rewards.sum() for track in tracks]),
        "length": evaluation.summary([len(track.times) for track in tracks]),
        "metrics": summaries,
    }


def number(value: float) -> str:
    """Three decimals, fewer for large numbers; a dash for NaN."""
    if math.isnan(value):
        return "-"
    return f"{value:.3f}" if abs(value) < 100.0 else f"{value:.0f}"


def print_robot(reports: dict) -> None:
    """The table of the robot's figures, policies side by side, mean +- standard deviation over episodes."""
    columns = "{:<18} {:<9}" + " {:>20}" * len(reports)
    header = columns.format("metric", "unit", *reports)
    print(header, "-" * len(header), sep="\n")
    rows = {name: ("", [r[name] for r in reports.values()]) for name in ("return", "length")}
    for name, metric in style.METRICS.items():
        rows[name] = (metric.unit, [r["metrics"][name]["robot"] for r in reports.values()])
    for name, (unit, summaries) in rows.items():
        cells = [
            f"{number(s.mean)} +- {number(s.deviation)}" if math.isfinite(s.mean) else number(s.mean) for s in summaries
        ]
        print(columns.format(name.replace("_", " "), unit, *cells))


def print_legs(label: str, figures: dict) -> None:
    """The table of a policy's figures by leg, means over episodes."""
    by_leg = {name: metric for name, metric in figures["metrics"].items() if metric["legs"]}
    legs = next(iter(by_leg.values()))["legs"]
    columns = "{:<18} {:<9}" + " {:>7}" * len(legs)
    header = columns.format(f"{label}, by leg", "", *legs)
    print("", header, "-" * len(header), sep="\n")
    for name, metric in by_leg.items():
        cells = [number(summary.mean) for summary in metric["legs"].values()]
        print(columns.format(name.replace("_", " "), metric["unit"], *cells))


@contextlib.contextmanager
def pictures():
    """Yields a function that writes the pictures of tracks by label; does nothing without `--output`."""
    if FLAGS.output is None:
        yield lambda tracks: None
        return
    try:
        from arc_suite.style.pictures import PICTURES
    except ImportError as error:
        raise ValueError(f"pictures need matplotlib: pip install 'arc_suite[plot]' ({error})") from None
    folder = commands.folder(FLAGS.output)
    with contextlib.ExitStack() as stack:
        files = {name: stack.enter_context(commands.writing(folder / f"{name}.png")) for name in PICTURES}
        yield lambda tracks: [PICTURES[name](tracks).savefig(file) for name, file in files.items()]


def main():
    """Records, measures, prints and writes."""
    chosen = [(FLAGS.policy, FLAGS.preset)]
    if FLAGS.compare is not None:
        chosen.append((FLAGS.compare, FLAGS.compare_preset))
    labels = [f"{policy} {preset}" if policy == "cpg" else policy for policy, preset in chosen]
    if len(set(labels)) < len(labels):
        raise ValueError(f"--compare: expected another policy than {labels[0]!r}")
    walkers = {
        label: policies.policy(policy, FLAGS.robot, preset, FLAGS.seed)
        for label, (policy, preset) in zip(labels, chosen, strict=True)
    }
    with commands.writing_json(FLAGS.json) as file, pictures() as draw:
        tracks = {label: record(label, policy) for label, policy in walkers.items()}
        reports = {label: report(recorded) for label, recorded in tracks.items()}
        print(f"{FLAGS.robot}, {FLAGS.episodes} episodes, mean +- standard deviation\n")
        print_robot(reports)
        for label, figures in reports.items():
            print_legs(label, figures)
        draw({f"{FLAGS.robot}, {label}": recorded[0] for label, recorded in tracks.items()})
        file.update(
            robot=FLAGS.robot,
            episodes=FLAGS.episodes,
            seed=FLAGS.seed,
            policies=reports,
            versions=evaluation.versions(),
        )


if __name__ == "__main__":
    commands.run(main)
