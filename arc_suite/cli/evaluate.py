"""Evaluate a policy: the task's metrics, and return and length of episodes.

Walk's metrics are the mean speed, m/s, and gait compliance, the share of feet as prescribed. `return +- std` has the
mean and the standard deviation over the episodes. IQM is the interquartile mean of the return, with a stratified
bootstrap interval; fewer than ten episodes have none, as it would be too narrow. `zero` is the return of standing
still in the first ten of the episodes. The score is 0 for standing still and 1 for the best demonstrator; that of
another body, or of other settings, is measured in these ten, too. Where it earns less than a tenth more than standing
still, a line says so in place of a score. Where a score of at least 0.5 comes with less than half of the distance or
the tracking, a line says whose return has the score 1. With --preset medium, which is the paper's demonstrator, the
table ends with the paper's return. A policy that learned from the episodes is refused. The JSON holds every episode,
in the order of the seeds, the anchors of the score, and hashes of policy, body, model and task.

  arc-suite evaluate --robot all --policy cpg --episodes 10
  arc-suite evaluate --spec spider
  arc-suite evaluate --robot queen --set target_velocity=0.4
"""

import functools

from absl import flags

from arc_suite import checks, evaluation, files, seed_ranges, versions
from arc_suite.cli import outputs
from arc_suite.cli.flags import MAX_COUNT, define_walk, policy_name, preset_from_flags, setups_from_flags
from arc_suite.cli.program import progress
from arc_suite.cli.summary import transport_footnote
from arc_suite.evaluation import provenance, reports

FLAGS = flags.FLAGS
define_walk("all", ", or all")
flags.DEFINE_integer(
    "episodes", evaluation.EPISODES, "How many episodes for each robot.", lower_bound=1, upper_bound=MAX_COUNT
)
flags.DEFINE_integer("seed", 0, "Seed of the first episode; the others count on from it.", lower_bound=0)
flags.DEFINE_string("json", None, "File to write the metrics to, as JSON, with every episode.")


def main() -> None:
    """Print the table and write the JSON."""
    outputs.check_json(FLAGS.json)
    files.check_target(FLAGS.json)
    setups = setups_from_flags()
    checks.seed(FLAGS.seed + FLAGS.episodes - 1)
    policy = policy_name(FLAGS.policy)
    seeds = range(FLAGS.seed, FLAGS.seed + FLAGS.episodes)
    preset = preset_from_flags()
    training_seeds = provenance.training_seeds(policy, seeds)
    players = [reports.player(policy, setup, preset) for setup in setups.values()]
    with files.writing_json(FLAGS.json) as json_content:
        reports_of_robots = print_reports(players, seeds)
        any_report = reports_of_robots[0]  # all are of one task
        for report in reports_of_robots:
            if report.flaw:
                print(f"{report.label}: no score: {report.flaw}")
            if report.caution:
                print(f"{report.label}: {report.caution}")
        if "cost_of_transport" in any_report.progress:
            footnote = transport_footnote(report.setup.body for report in reports_of_robots)
            if footnote:
                print(footnote)
        if training_seeds is None:
            print(f"policy {policy}: {provenance.UNKNOWN}")
        json_content.update(
            task=any_report.setup.task,
            task_kwargs=any_report.setup.task_kwargs,
            policy=policy,
            policy_sha256=provenance.policy_sha256(policy),
            training_seeds=seed_ranges.to_json(training_seeds),
            seed=FLAGS.seed,
            robots={name: report.to_json() for name, report in zip(setups, reports_of_robots, strict=True)},
            versions=versions.dependency_versions(),
        )
        are_published = all(report.paper_return is not None for report in reports_of_robots)
        if len(reports_of_robots) > 1 and are_published:
            overall_share = share_of_paper_returns(reports_of_robots)
            json_content["return_over_paper"] = overall_share
            if any(report.of_the_paper for report in reports_of_robots):
                text = "all          IQM of return / paper's cpg: {:.3f} [{:.3f}, {:.3f}]"
                print(text.format(overall_share["iqm"], *overall_share["interval"]))


def print_reports(players: list[reports.Player], seeds: range) -> list[evaluation.Report]:
    """Play the episodes behind progress bars, print a line for each body, and return the reports."""
    labels = [reports.label(player.setup, player.preset) for player in players]
    label_width = max(reports.MIN_LABEL_WIDTH, *(len(label) for label in labels))  # of the first column
    reports_of_robots: list[evaluation.Report] = []
    for player in players:
        bar = functools.partial(progress, desc=player.setup.name, unit="episode", leave=False)
        report = reports.report(player, seeds, bar)
        is_first = not reports_of_robots
        if is_first:
            heading = report.heading(label_width)
            print(heading, "-" * len(heading), sep="\n")
        print(report.line(label_width), flush=True)
        reports_of_robots.append(report)
    return reports_of_robots


def share_of_paper_returns(reports_of_robots: list[evaluation.Report]) -> dict:
    """Return the returns of all robots as shares of the paper's demonstrators', with robots as strata."""
    shares = [[episode.total / report.paper_return for episode in report.episodes] for report in reports_of_robots]
    iqm, interval = evaluation.iqm_and_interval(shares)
    return {"iqm": iqm, "interval": interval}
