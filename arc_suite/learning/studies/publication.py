"""Publication: copies the results of runs that are committed, with the style of their latest policies."""

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from arc_suite import evaluation, files, policies, style
from arc_suite.cpg.selection import presets_of
from arc_suite.envs.dm import Environment
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import anchors
from arc_suite.learning.agents import run_folder
from arc_suite.learning.agents.run_folder import table
from arc_suite.learning.studies import results
from arc_suite.learning.studies.tables import Run
from arc_suite.policies import Policy, checkpoints, network
from arc_suite.simulation.opengl import RenderingUnavailable
from arc_suite.style import strips

PUBLISHED = (run_folder.CONFIG, "evaluations.csv", "times.csv")

# Metrics of `arc_suite.style` by which the final policies are compared.
METRICS = ("heading_error", "lateral_drift", "torso_pitch", "gait_compliance", "foot_slip", "asymmetry")

# Presets of demonstrators whose returns are published, in `walk`, and in tasks with a command; and the best one.
PRESETS, COMMANDED = ("medium", "refined"), ("steered", "surefooted")


def publish(run: Run, folder: Path, published: Path) -> None:
    """Copy the tables of a run that has been evaluated, and measure and draw the style of its latest policy.

    Existing style and strip of the same policy stay. Without OpenGL no strip is drawn.

    Args:
        run: of the study.
        folder: of the study, with a folder for each run.
        published: folder of the copies, with a folder for each run.

    Raises:
        OSError: a file cannot be written.
    """
    source, target = folder / run.name, published / run.name
    steps = results.evaluated(table(source, "evaluations"))
    if not len(steps):
        return
    files.folder(target)
    config = target / run_folder.CONFIG
    if config.exists() and config.read_bytes() != (source / run_folder.CONFIG).read_bytes():
        (target / "style.csv").unlink(missing_ok=True)  # of another run
    for name in PUBLISHED:
        with files.writing(target / name) as temporary:
            temporary.write_bytes((source / name).read_bytes())
    training = table(source, "training")
    if np.any(training.get("phase_updates", 0)):
        with files.writing(target / "phases.csv") as temporary:
            temporary.write_text(_phases(training), encoding="utf-8")
    step = int(steps[-1])
    measured, drawn = table(target, "style"), target / results.STRIP
    up_to_date = bool(measured) and measured["step"][-1] == step
    if not up_to_date:
        drawn.unlink(missing_ok=True)  # before the style is written: then both are of the same policy
    if not drawn.exists():
        with contextlib.suppress(RenderingUnavailable), _played(run, source, step) as (environment, policy):
            if (picture := strips.strip(environment, policy)) is not None:
                with files.writing(drawn) as temporary:
                    strips.write(temporary, picture)
    if not up_to_date:
        text = _style(run, source, step)  # slow; a kill meanwhile leaves no temporary file
        with files.writing(target / "style.csv") as temporary:
            temporary.write_text(text, encoding="utf-8")


def _phases(training: Mapping[str, np.ndarray]) -> str:
    """Return a table of the updates of stabilisation phases by environment step."""
    pairs = zip(training["step"].astype(int), training["phase_updates"].astype(int), strict=True)
    return "\n".join(["step,updates", *(f"{step},{updates}" for step, updates in pairs if updates)]) + "\n"


def publish_all(runs: Sequence[Run], folder: Path, published: Path) -> None:
    """Publish all evaluated runs of a study, and what standing still and demonstrators earn in the same tasks.

    Raises:
        OSError: a file cannot be written.
    """
    for run in runs:
        publish(run, folder, published)
    known = results.demonstrators(published)
    setups = {run.place: run.configuration.validation for run in runs}
    if setups.keys() <= known.keys() or not published.exists():
        return
    measured = {place: _demonstrated(setup) for place, setup in setups.items() if place not in known}
    with files.writing(published / results.DEMONSTRATORS) as temporary:
        anchors.write(temporary, known | measured)


def _demonstrated(setup: Setup) -> anchors.Returns:
    """Return the returns of the evaluation protocol of standing still and of demonstrators of a body, by policy."""
    found = dict(anchors.known(setup) or anchors.measured(setup))
    usual = COMMANDED if "command" in setup.definition.blocks else PRESETS
    missing = [preset for preset in usual if preset in presets_of(setup.body) and preset not in found]
    return found | {preset: anchors.played(setup, preset) for preset in missing}


@contextlib.contextmanager
def _played(run: Run, folder: Path, step: int) -> Iterator[tuple[Environment, Policy]]:
    """Open the environment of a run, and its policy at a step, as a later one may exist already."""
    path, setup = folder / checkpoints.FOLDER / str(step) / network.FILE, run.configuration.validation
    with contextlib.closing(setup.load()) as environment:
        yield environment, policies.policy(path, setup.body, task=environment.task.definition)


def _style(run: Run, folder: Path, step: int) -> str:
    """Return a table of the metrics of the episodes of the evaluation protocol."""
    lines = []
    with _played(run, folder, step) as (environment, policy):
        for seed in range(evaluation.EPISODES):
            measured = style.measure(style.record(environment, policy, seed))
            metrics = {name: measured[name].value for name in METRICS if name in measured}
            lines.append(",".join(map(repr, (step, seed, *metrics.values()))))
    return "\n".join([",".join(("step", "seed", *metrics)), *lines]) + "\n"
