"""Judge a policy: return, length, speed and gait compliance of its episodes.

The return stands beside that of the paper's demonstrator, where the task is the paper's. IQM is the
interquartile mean of the return, with a stratified bootstrap interval.

  arc-suite evaluate --robot all --policy cpg --preset medium --episodes 10
  arc-suite evaluate --spec examples/spider.json
  arc-suite evaluate --robot queen --set target_velocity=0.4
"""

import numpy as np
from absl import flags

import arc_suite
from arc_suite import checks, evaluation, files, policies, versions
from arc_suite.cli.flags import bodies, define_body, define_task, task
from arc_suite.cli.program import progress
from arc_suite.robots import ROBOTS

FLAGS = flags.FLAGS
define_body()
define_task()
_ROBOT = flags.DEFINE_string("robot", "all", f"{', '.join(ROBOTS)}, or all.")
flags.DEFINE_string("policy", "cpg", policies.HELP)
flags.DEFINE_string("preset", "medium", policies.PRESET_HELP)
flags.DEFINE_integer("episodes", evaluation.EPISODES, "How many episodes for each robot.", lower_bound=1)
flags.DEFINE_integer("seed", 0, "Seed of the first episode; the others count on from it.", lower_bound=0)
flags.DEFINE_string("json", None, "File to write the figures to, as JSON, with every episode.")

COLUMNS = "{:<12} {:>16} {:>26} {:>12} {:>14} {:>12} {:>13}"


def main() -> None:
    """Print the table and write the JSON."""
    walkers = bodies(_ROBOT)
    task_name, task_kwargs = task()
    checks.seed(FLAGS.seed + FLAGS.episodes - 1)
    players = {
        name: (
            arc_suite.load(body, task_name, task_kwargs),
            policies.policy(FLAGS.policy, body, FLAGS.preset, FLAGS.seed),
        )
        for name, body in walkers.items()
    }
    # The paper's demonstrators walked by the published numbers; with others there is nothing to compare with.
    experts = evaluation.EXPERT_RETURNS if (task_name, task_kwargs) == ("walk", {}) else {}
    with files.writing_json(FLAGS.json) as file:
        header = COLUMNS.format(
            "robot", "return", "IQM [95 % interval]", "paper's cpg", "length", "speed", "compliance"
        )
        print(header, "-" * len(header), sep="\n")
        reports = {}
        for robot, (environment, policy) in players.items():
            reports[robot] = report(evaluate(robot, environment, policy), experts.get(robot))
            print(row(robot, reports[robot]), flush=True)
        file.update(
            task=task_name,
            task_kwargs=task_kwargs,
            policy=FLAGS.policy,
            preset=FLAGS.preset if FLAGS.policy == "cpg" else None,
            seed=FLAGS.seed,
            robots=reports,
            versions=versions.recorded(),
        )
        if len(reports) > 1 and reports.keys() <= experts.keys():
            file["return_over_expert"] = total = over_all(reports)
            print(
                "all          IQM of return / paper's cpg: {:.3f} [{:.3f}, {:.3f}]".format(
                    total["iqm"], *total["interval"]
                )
            )


def evaluate(robot: str, environment, policy) -> list[evaluation.Episode]:
    """Run the episodes of one robot behind a progress bar."""
    seeds = range(FLAGS.seed, FLAGS.seed + FLAGS.episodes)
    with progress(seeds, desc=robot, unit="episode", leave=False) as bar:
        return evaluation.episodes(environment, policy, bar)


def report(episodes: list[evaluation.Episode], expert: float | None) -> dict:
    """Return the figures of one robot, as they go into the JSON.

    Args:
        episodes: of the robot.
        expert: return of the paper's demonstrator, if it has one.
    """
    total, length, speed, compliance = (evaluation.summary(values) for values in np.transpose(episodes))
    return {
        "expert_return": expert,
        "return": total,
        "length": length,
        "speed": speed,
        "compliance": compliance,
        "episodes": episodes,
    }


def row(robot: str, figures: dict) -> str:
    """Return one line of the table."""
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
    """Return the returns of all robots as shares of the paper's demonstrators', with robots as strata."""
    shares = [[episode.total / r["expert_return"] for episode in r["episodes"]] for r in reports.values()]
    iqm, interval = evaluation.iqm_and_interval(shares)
    return {"iqm": iqm, "interval": interval}
