"""Evaluate a policy: the task's metrics, and return and length of episodes.

Walk's metrics are the mean speed, m/s, and gait compliance, the share of feet as prescribed. IQM is
the interquartile mean of the return, with a stratified bootstrap interval. `zero` is the return of standing
still in the first ten of the episodes. The score is 0 for standing still and 1 for the best demonstrator of the
suite; only places of the benchmark have one. With --preset medium, which is the paper's demonstrator, the table
ends with the paper's return. A policy that learned from the episodes is refused. The JSON is an entry for
`arc-suite enter`: it holds every episode, and hashes of policy, body, model and task.

  arc-suite evaluate --robot all --policy cpg --episodes 10
  arc-suite evaluate --spec spider
  arc-suite evaluate --robot queen --set target_velocity=0.4
"""

from collections.abc import Mapping

from absl import flags

from arc_suite import checks, evaluation, files, policies, seed_ranges, versions
from arc_suite.cli.flags import MOST, define_walk, policy_name, setups
from arc_suite.cli.program import progress
from arc_suite.cli.summary import footnote
from arc_suite.cpg import suited_preset
from arc_suite.evaluation import anchors, provenance

FLAGS = flags.FLAGS
define_walk("all", ", or all")
flags.DEFINE_integer("episodes", evaluation.EPISODES, "How many episodes for each robot.", 1, MOST)
flags.DEFINE_integer("seed", 0, "Seed of the first episode; the others count on from it.", lower_bound=0)
flags.DEFINE_string("json", None, "File to write the metrics to, as JSON, with every episode.")

_WIDTHS = (18, 9, 7, 26, 9, 12)  # of the columns that every task has


def line(first: str, metrics: Mapping[str, str], *cells: str) -> str:
    """Return a line of the table.

    Args:
        first: cell of the first column, as wide as the column.
        metrics: the task's own by name.
        *cells: of the columns that every task has, the last of which may be missing.
    """
    own = [f"{cell:>{max(len(name), 6)}}" for name, cell in metrics.items()]
    return " ".join([first, *own, *(f"{cell:>{width}}" for cell, width in zip(cells, _WIDTHS, strict=False))])


def main() -> None:
    """Print the table and write the JSON."""
    asked = setups()
    checks.seed(FLAGS.seed + FLAGS.episodes - 1)
    chosen, players, presets = policy_name(FLAGS.policy), {}, {}
    training_seeds = provenance.training_seeds(chosen, range(FLAGS.seed, FLAGS.seed + FLAGS.episodes))
    for name, setup in asked.items():
        environment, body = setup.load(), setup.body
        task = environment.task.definition
        if chosen == "cpg":
            presets[name] = suited_preset(task) if FLAGS.preset is None else FLAGS.preset
        policy = policies.policy(chosen, body, presets.get(name, FLAGS.preset), task=task)
        players[name] = environment, policy
    experts = {name: evaluation.expert_return(setup) for name, setup in asked.items()}
    papers = [name for name, expert in experts.items() if expert is not None and presets.get(name) == "medium"]
    with files.writing_json(FLAGS.json) as file:
        reports = {}
        labels = {name: f"{name}, {presets[name]}" if name in presets else name for name in players}
        width = max(12, *map(len, labels.values()))
        for robot, (environment, policy) in players.items():
            episodes = evaluate(robot, environment, policy)
            seeds = range(FLAGS.seed, FLAGS.seed + min(FLAGS.episodes, evaluation.CURVE_EPISODES))
            stood = float(anchors.played(asked[robot], anchors.ZERO, seeds).mean())
            known = anchors.known(asked[robot])
            if not reports:
                names = {name: name for name in episodes[0].progress}
                heads = ["return", "zero", "score", "IQM [95 % interval]", "steps", *["paper's cpg"] * bool(papers)]
                header = line("robot".ljust(width), names, *heads)
                print(header, "-" * len(header), sep="\n")
            reports[robot] = {
                "provenance": provenance.of_setup(asked[robot]),
                "preset": presets.get(robot),
                **report(episodes, stood, experts[robot], None if known is None else anchors.of_returns(known)),
            }
            print(row(labels[robot].ljust(width), reports[robot], robot in papers), flush=True)
        if "cost_of_transport" in names and (text := footnote(setup.body for setup in asked.values())):
            print(text)
        if training_seeds is None:
            print(f"policy {chosen}: {provenance.UNKNOWN}")
        file.update(
            task=setup.task,
            task_kwargs=setup.task_kwargs,
            policy=chosen,
            policy_sha256=provenance.policy_sha256(chosen),
            training_seeds=seed_ranges.to_json(training_seeds),
            seed=FLAGS.seed,
            robots=reports,
            versions=versions.recorded(),
        )
        if len(reports) > 1 and None not in experts.values():
            file["return_over_expert"] = total = over_all(reports)
            if papers:
                text = "all          IQM of return / paper's cpg: {:.3f} [{:.3f}, {:.3f}]"
                print(text.format(total["iqm"], *total["interval"]))


def evaluate(robot: str, environment, policy) -> list[evaluation.EpisodeResult]:
    """Run the episodes of one robot behind a progress bar."""
    seeds = range(FLAGS.seed, FLAGS.seed + FLAGS.episodes)
    with progress(seeds, desc=robot, unit="episode", leave=False) as bar:
        return evaluation.episodes(environment, policy, bar)


def report(
    episodes: list[evaluation.EpisodeResult], zero: float, expert: float | None, scale: anchors.Anchors | None
) -> dict:
    """Return the metrics of one robot, as in the JSON.

    Args:
        episodes: of the robot.
        zero: return of standing still.
        expert: return of the paper's demonstrator, if it has one.
        scale: committed anchors of the score, if there are any.
    """
    total = evaluation.summary([episode.total for episode in episodes])
    progress = {name: [episode.progress[name] for episode in episodes] for name in episodes[0].progress}
    return {
        "zero_return": zero,
        "expert_return": expert,
        "return": total,
        "score": None if scale is None else float(scale.score(total.mean)),
        "length": evaluation.summary([episode.length for episode in episodes]),
        **{name: evaluation.summary(values) for name, values in progress.items()},
        "episodes": episodes,
    }


def row(robot: str, metrics: dict, with_paper: bool) -> str:
    """Return one line of the table, which may end with the paper's return."""
    total, progress = metrics["return"], metrics["episodes"][0].progress
    return line(
        robot,
        {name: f"{metrics[name].mean:.3f}" for name in progress},
        f"{total.mean:.1f} +- {total.deviation:.1f}",
        f"{metrics['zero_return']:.1f}",
        "-" if metrics["score"] is None else f"{metrics['score']:z.2f}",
        "{:.1f} [{:.1f}, {:.1f}]".format(total.iqm, *total.interval),
        f"{metrics['length'].mean:.1f}",
        *([f"{metrics['expert_return']:.0f}"] if with_paper else []),
    )


def over_all(reports: dict) -> dict:
    """Return the returns of all robots as shares of the paper's demonstrators', with robots as strata."""
    shares = [[episode.total / r["expert_return"] for episode in r["episodes"]] for r in reports.values()]
    iqm, interval = evaluation.iqm_and_interval(shares)
    return {"iqm": iqm, "interval": interval}
