"""Evaluate a policy: the task's metrics, and return and length of episodes.

Walk's metrics are the mean speed, m/s, and gait compliance, the share of feet as prescribed. IQM is
the interquartile mean of the return, with a stratified bootstrap interval. `zero` is the return of standing
still in the first ten of the episodes. The score is 0 for standing still and 1 for the best demonstrator of the
suite; only places of the benchmark have one. With --preset medium, which is the paper's demonstrator, the table
ends with the paper's return. A policy that learned from the episodes is refused. The JSON holds every episode, and
hashes of policy, body, model and task.

  arc-suite evaluate --robot all --policy cpg --episodes 10
  arc-suite evaluate --spec spider
  arc-suite evaluate --robot queen --set target_velocity=0.4
"""

import functools

from absl import flags

from arc_suite import checks, evaluation, files, seed_ranges, versions
from arc_suite.cli.flags import MAX_COUNT, define_walk, policy_name, setups_from_flags
from arc_suite.cli.program import progress
from arc_suite.cli.summary import transport_footnote
from arc_suite.evaluation import provenance, reports

FLAGS = flags.FLAGS
define_walk("all", ", or all")
flags.DEFINE_integer("episodes", evaluation.EPISODES, "How many episodes for each robot.", 1, MAX_COUNT)
flags.DEFINE_integer("seed", 0, "Seed of the first episode; the others count on from it.", lower_bound=0)
flags.DEFINE_string("json", None, "File to write the metrics to, as JSON, with every episode.")


def main() -> None:
    """Print the table and write the JSON."""
    asked = setups_from_flags()
    checks.seed(FLAGS.seed + FLAGS.episodes - 1)
    chosen, seeds = policy_name(FLAGS.policy), range(FLAGS.seed, FLAGS.seed + FLAGS.episodes)
    training_seeds = provenance.training_seeds(chosen, seeds)
    players = [reports.player(chosen, setup, FLAGS.preset) for setup in asked.values()]
    with files.writing_json(FLAGS.json) as file:
        found = played(players, seeds)
        if "cost_of_transport" in found[0].progress and (text := transport_footnote(each.setup.body for each in found)):
            print(text)
        if training_seeds is None:
            print(f"policy {chosen}: {provenance.UNKNOWN}")
        file.update(
            task=found[0].setup.task,
            task_kwargs=found[0].setup.task_kwargs,
            policy=chosen,
            policy_sha256=provenance.policy_sha256(chosen),
            training_seeds=seed_ranges.to_json(training_seeds),
            seed=FLAGS.seed,
            robots={name: each.to_json() for name, each in zip(asked, found, strict=True)},
            versions=versions.dependency_versions(),
        )
        if len(found) > 1 and all(each.expert is not None for each in found):
            file["return_over_expert"] = total = over_all(found)
            if any(each.of_the_paper for each in found):
                text = "all          IQM of return / paper's cpg: {:.3f} [{:.3f}, {:.3f}]"
                print(text.format(total["iqm"], *total["interval"]))


def played(players: list[reports.Player], seeds: range) -> list[evaluation.Report]:
    """Play the episodes behind progress bars, print a row for each body, and return the reports."""
    found, width = [], max(reports.LABEL, *(len(reports.label(each.setup, each.preset)) for each in players))
    for player in players:
        bar = functools.partial(progress, desc=player.setup.body.name, unit="episode", leave=False)
        found.append(reports.report(player, seeds, bar))
        if len(found) == 1:
            heading = found[0].heading(width)
            print(heading, "-" * len(heading), sep="\n")
        print(found[-1].line(width), flush=True)
    return found


def over_all(found: list[evaluation.Report]) -> dict:
    """Return the returns of all robots as shares of the paper's demonstrators', with robots as strata."""
    shares = [[episode.total / each.expert for episode in each.episodes] for each in found]
    iqm, interval = evaluation.iqm_and_interval(shares)
    return {"iqm": iqm, "interval": interval}
