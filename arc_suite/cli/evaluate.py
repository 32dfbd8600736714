"""Judges a policy: return, episode length, speed and gait compliance, beside the paper's expert line.

IQM is the interquartile mean of the return, with a stratified bootstrap interval.

Example:
  python tools/evaluate.py --robot all --policy cpg --preset medium --episodes 10
  python tools/evaluate.py --spec examples/spider.json
"""

import numpy as np
from absl import flags
from tqdm import tqdm

import arc_suite
from arc_suite import checks, evaluation, files, policies, versions
from arc_suite.cli import body_flags, program
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec import Body

FLAGS = flags.FLAGS
_ROBOT = flags.DEFINE_string("robot", "all", f"{', '.join(ROBOTS)}, or all.")
flags.DEFINE_string("policy", "cpg", policies.HELP)
flags.DEFINE_string("preset", "medium", policies.PRESET_HELP)
flags.DEFINE_integer("episodes", evaluation.EPISODES, "How many episodes for each robot.", lower_bound=1)
flags.DEFINE_integer("seed", 0, "Seed of the first episode; the others count on from it.", lower_bound=0)
flags.DEFINE_string("json", None, "File to write the figures to, as JSON, with every episode.")

COLUMNS = "{:<12} {:>16} {:>26} {:>12} {:>14} {:>12} {:>13}"


def evaluate(body: Body, policy) -> list[evaluation.Episode]:
    """Runs the episodes of one body behind a progress bar."""
    environment = arc_suite.load(body, "walk")
    with tqdm(range(FLAGS.seed, FLAGS.seed + FLAGS.episodes), desc=body.name, unit="episode", leave=False) as seeds:
        return evaluation.episodes(environment, policy, seeds)


def report(robot: str, episodes: list[evaluation.Episode]) -> dict:
    """The figures of one robot, as they go into the JSON."""
    total, length, speed, compliance = (evaluation.summary(values) for values in np.transpose(episodes))
    return {
        "expert_return": evaluation.EXPERT_RETURNS.get(robot),
        "return": total,
        "length": length,
        "speed": speed,
        "compliance": compliance,
        "episodes": episodes,
    }


def row(robot: str, figures: dict) -> str:
    """One line of the table."""
    total = figures["return"]
    return COLUMNS.format(
        robot,
        f"{total.mean:.1f} +- {total.deviation:.1f}",
        "{:.1f} [{:.1f}, {:.1f}]".format(total.iqm, *total.interval),
        "-" if figures["expert_return"] is None else f"{figures['expert_return']:.0f}",
        f"{figures['length'].mean:.1f} steps",
        f"{figures['speed'].mean:.3f} m/s",
        f"{100 * figures['compliance'].mean:.1f} %",
    )


def over_all(reports: dict) -> dict:
    """The returns of all robots as shares of the paper's demonstrators', with robots as strata."""
    shares = [[episode.total / r["expert_return"] for episode in r["episodes"]] for r in reports.values()]
    iqm, interval = evaluation.iqm_and_interval(shares)
    return {"iqm": iqm, "interval": interval}


def main():
    """Prints the table and writes the JSON."""
    bodies = body_flags.bodies(_ROBOT)
    checks.seed(FLAGS.seed + FLAGS.episodes - 1)
    walkers = {name: policies.policy(FLAGS.policy, body, FLAGS.preset, FLAGS.seed) for name, body in bodies.items()}
    with files.writing_json(FLAGS.json) as file:
        header = COLUMNS.format(
            "robot", "return", "IQM [95 % interval]", "paper's cpg", "length", "speed", "compliance"
        )
        print(header, "-" * len(header), sep="\n")
        reports = {}
        for robot, policy in walkers.items():
            reports[robot] = report(robot, evaluate(bodies[robot], policy))
            print(row(robot, reports[robot]), flush=True)
        file.update(
            policy=FLAGS.policy,
            preset=FLAGS.preset if FLAGS.policy == "cpg" else None,
            seed=FLAGS.seed,
            robots=reports,
            versions=versions.recorded(),
        )
        if len(reports) > 1:
            file["return_over_expert"] = total = over_all(reports)
            print(
                "all          IQM of return / paper's cpg: {:.3f} [{:.3f}, {:.3f}]".format(
                    total["iqm"], *total["interval"]
                )
            )


if __name__ == "__main__":
    program.run(main)
