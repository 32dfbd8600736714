"""Model cards: README.md in the folder of a run, which model hubs show.

A card says what the policy is, how well it does, and how it was made.
"""

import contextlib
import json
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from arc_suite import evaluation, files, policies, registry
from arc_suite.evaluation import anchors, statistics
from arc_suite.learning import finals
from arc_suite.learning.agents import run_folder
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.learning.next_commands import next_commands
from arc_suite.learning.studies.text_tables import table
from arc_suite.policies import network
from arc_suite.simulation.opengl import RenderingUnavailable

FILE = "README.md"
PICTURE = "picture.png"
_STEPS_OF_PICTURE = 40  # control steps before the picture: the walk has begun
_SEED_OF_PICTURE = 9000  # of validation
_SIZE_OF_PICTURE = (360, 480)  # pixels
_MAX_COMMAND = 1000  # characters of a command that a reader copies; the text of a file takes thousands


def write(run: Configuration, folder: Path) -> Path:
    """Write the card of a run, and a picture of its policy where OpenGL is available; return the card's path.

    Args:
        run: configuration of the run.
        folder: folder of the run, which has a policy.

    Raises:
        ValueError: the run has no policy yet, or a file of the folder is damaged.
        OSError: a file cannot be read or written.
    """
    if not run_folder.table(folder, "evaluations"):
        raise ValueError(f"{folder}: no evaluation yet, so there is no policy to describe")
    if not run.setup.several:
        _draw(run, folder)
    path = folder / FILE
    files.write(path, text(run, folder))
    return path


def text(run: Configuration, folder: Path) -> str:
    """Return the card of a run in Markdown."""
    robot = run.setup.name
    task = run.setup.kind.name
    path = _relative_path(folder)
    returns, episodes_text = _read_returns(folder)
    pictures = [f"![{name}]({name})" for name in (PICTURE, "curve.png") if (folder / name).exists()]
    parts = [
        _metadata(run, returns.mean()),
        f"# {folder.resolve().name}",
        f"A policy of [arc_suite](https://arxiv.org/abs/2605.19503) for `{robot}` in the task `{task}`, learned by "
        f"`{run.algorithm}`.",
        table(("what", "value"), _describe(run, folder, returns, episodes_text)),
        *pictures,
        "## Use",
        _installation_text(folder),
        _code("sh", ["pip install -e '.[animate]'"]),
        f"The commands read the folder of this card as `{path}`.",
        _code("sh", next_commands(run.policy_setup, path, has_pages=False)),
        "## How it was made",
        _code("sh", [_training_command(run)]),
        "`config.json` has all settings and hyperparameters.",
        table(("hash or version", "value"), _describe_origin(folder)),
        "## License",
        _license_text(run),
    ]
    return "\n\n".join(parts) + "\n"


def _relative_path(folder: Path) -> Path:
    """Return a run's folder as seen from the current folder, or as one of `runs` where it lies elsewhere."""
    path = folder.resolve()
    if Path.cwd() in path.parents:
        return path.relative_to(Path.cwd())
    return Path(files.RUNS_FOLDER) / path.name


def _metadata(run: Configuration, mean_return: float) -> str:
    """Return what model hubs read at the head of a card: YAML, of values that are JSON."""
    environment = f"{run.setup.name}-{run.setup.kind.name}"
    metric = {"type": "mean_reward", "name": "mean return", "value": round(float(mean_return), 1)}
    result = {
        "task": {"type": "reinforcement-learning"},
        "dataset": {"name": environment, "type": environment},
        "metrics": [metric],
    }
    fields = {
        "license": "apache-2.0" if _is_of_suite(run) else "other",
        "library_name": "arc_suite",
        "pipeline_tag": "reinforcement-learning",
        "tags": ["reinforcement-learning", "legged-locomotion", "mujoco", run.setup.kind.name, run.algorithm],
        "model-index": [{"name": run.name, "results": [result]}],
    }
    lines = [f"{name}: {json.dumps(value)}" for name, value in fields.items()]
    return "\n".join(["---", *lines, "---"])


def _is_of_suite(run: Configuration) -> bool:
    """Return whether all parts are the suite's; what is made of parts of others has a license of its own."""
    return _has_body_of_suite(run) and not run.parts_of_others


def _has_body_of_suite(run: Configuration) -> bool:
    """Return whether the bodies are the suite's; those of others have licenses of their own."""
    kinds = {kind for kind, _ in run.parts_of_others}
    if kinds & {"robot", "family"}:
        return False
    return run.setup.several or registry.is_body_of_suite(run.setup.body)


def _license_text(run: Configuration) -> str:
    body_text = "The creature and its looks are the suite's"
    if _is_of_suite(run):
        return f"Apache-2.0, as the suite. {body_text}."
    names = [f"the {kind} `{name}`" for kind, name in run.parts_of_others]
    sentences = [f"Not of the suite: {', '.join(names)}."] if names else []
    if _has_body_of_suite(run):
        sentences.append(f"{body_text}, under Apache-2.0.")
    else:
        sentences.append(f"`{run.setup.name}` is no robot of the suite: its license is that of the body's author.")
    sentences.append("The license of this policy is for its author to state: set `license` at the head of this card.")
    return " ".join(sentences)


def _read_returns(folder: Path) -> tuple[np.ndarray, str]:
    """Return the returns of the episodes that judge the policy, or of the latest evaluation, and what they are."""
    final_lines = run_folder.lines(folder, finals.TABLE, finals.COLUMNS)
    if finals.are_of(final_lines, network.digest(network.load(folder))):  # a run goes on after its judging
        return np.array([line["return"] for line in final_lines], float), "judging episodes"
    return run_folder.latest_returns(run_folder.table(folder, "evaluations")), "episodes of the latest evaluation"


def _describe(run: Configuration, folder: Path, returns: np.ndarray, episodes_text: str) -> Iterator[tuple[str, str]]:
    mean, interval = statistics.mean_and_interval([returns.tolist()])
    scale = anchors.anchors(run.validation)
    labeled_settings = run.setup.labeled_settings
    settings = json.dumps(labeled_settings) if labeled_settings else "defaults"
    yield "robot", run.setup.name
    yield "task", run.setup.kind.name
    yield "settings", f"`{_shorten(settings)}`"
    if run.training:
        training = run.setup.with_settings(run.training, dropped=run.setup.task_kwargs)
        yield "settings in training alone", f"`{_shorten(json.dumps(training.labeled_settings))}`"
    yield "algorithm, seed", f"{run.algorithm}, {run.seed}"
    yield "steps", f"{int(run_folder.read_progress(folder)['evaluated']):,} of {run.steps:,}"
    yield "return", f"{mean:.1f}, 95 % interval {_interval_text(interval, '.1f')}, {returns.size} {episodes_text}"
    if scale.flaw:
        yield "score", f"none: {scale.flaw}"
    else:
        score_ends = scale.score(np.array(interval))
        yield "score", f"{scale.score(mean):.2f}, 95 % interval {_interval_text(score_ends, '.2f')}"
        yield "score 0, standing still", f"{scale.zero:.1f}"
        yield "score 1, demonstrator", f"`{scale.preset}`, {scale.demonstrator:.1f}"


def _describe_origin(folder: Path) -> Iterator[tuple[str, str]]:
    record = run_folder.read_config(folder)
    policy = network.load(folder)
    yield "policy, sha256", f"`{network.digest(policy)}`"
    for name, value in record.items():
        if name.endswith("_sha256") and isinstance(value, str):
            yield f"{name.removesuffix('_sha256')}, sha256", f"`{value}`"
    if run_folder.COMMIT in record:
        yield "commit of arc_suite", f"`{record[run_folder.COMMIT]}`"
    for package, version in record.get("versions", {}).items():
        if version is not None:
            yield package, str(version)


def _installation_text(folder: Path) -> str:
    """Return the sentence that says where the suite is installed."""
    commit = run_folder.read_config(folder).get(run_folder.COMMIT)
    at_commit = f", at the commit `{commit.removesuffix('-dirty')}`" if isinstance(commit, str) else ""
    return f"Install the suite in a clone of its repository{at_commit}."


def _training_command(run: Configuration) -> str:
    """Return the command that trains a run again: by its configuration, which holds bodies and motions of files."""
    is_body_of_file = run.setup.robot.startswith("{")
    if is_body_of_file or len(run.command) > _MAX_COMMAND:
        return "arc-suite train --config config.json -o again"
    return run.command


def _draw(run: Configuration, folder: Path) -> None:
    """Write a picture of the walking policy; none without OpenGL."""
    import imageio.v3 as imageio  # takes a fifth of a second

    environment = run.policy_setup.load()
    policy = policies.acting(network.load(folder), environment.task.definition)
    evaluation.run(environment, policy, _SEED_OF_PICTURE, max_steps=_STEPS_OF_PICTURE)
    with contextlib.suppress(RenderingUnavailable):
        picture = environment.physics.render(*_SIZE_OF_PICTURE, camera_id="portrait", quality="still")
        with files.writing(folder / PICTURE) as temporary:
            imageio.imwrite(temporary, picture, extension=".png")


def _code(kind: str, lines: Sequence[str]) -> str:
    return "\n".join([f"```{kind}", *lines, "```"])


def _interval_text(interval: Sequence[float], form: str) -> str:
    low, high = interval
    return f"[{low:{form}}, {high:{form}}]"


def _shorten(value: str) -> str:
    """Return a text of one cell: long values, such as bodies and grounds, are in config.json."""
    return value if len(value) <= 300 else f"{value[:300]}..."
