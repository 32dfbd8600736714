"""Write a trained policy as ONNX, for game engines and onnxruntime.

The normalizer is inside; the metadata hold the robot, the observation's blocks, the control step, the
gears of the motors and the rule of the gait's clock. docs/engines.md says what a game needs next to it.

  arc-suite export runs/tick-walk-ppo-0
  arc-suite export runs/tick-walk-ppo-0 -o tick.onnx
  arc-suite export ppo.zip
  arc-suite export runs/go2-steer-ppo-0 --runner robot
  arc-suite export universal --spec spider --task steer -o spider.onnx
  arc-suite export runs/mine --robot my_robot:mine --task my_task:carry

--runner writes a folder for the computer of a robot: policy.onnx, policy.json, and run.py, a file of Python that needs
NumPy and onnxruntime alone. It prints which action moves which motor.

A policy of many bodies is exported for the body of --robot, --spec or --legs. For a policy of one body, --robot, --task
and --set name parts of other packages, which are then imported; files import nothing.
A zip of stable-baselines3 must have been trained in arc_suite.envs.sb3.VecEnv: then it holds its robot and task.
Demonstrators and functions of one's own are not networks, and are not exported.
"""

from pathlib import Path

from absl import flags

from arc_suite import checks, files, policies
from arc_suite.bodies import universal
from arc_suite.cli import outputs
from arc_suite.cli.flags import (
    NAMING_FLAGS,
    complete_task,
    custom_body,
    define_body,
    define_task,
    define_vecnormalize,
    hint_import,
    only_body,
    policy_name,
    policy_setup,
    task_from_flags,
)
from arc_suite.envs.setup import Setup
from arc_suite.learning import best, onnx_file, runner_files
from arc_suite.learning.agents import configuration, run_folder
from arc_suite.policies import checkpoints, network
from arc_suite.policies.network import Network

FLAGS = flags.FLAGS
define_body(None, "; for a policy of many bodies, or that of the policy")
define_vecnormalize()
define_task()
flags.DEFINE_string("output", None, "File to write (.onnx). [default: policy.onnx next to the policy]", short_name="o")


flags.DEFINE_string("runner", None, "Folder to write for a robot: policy.onnx, policy.json and run.py.")


def main(run: str | None = None) -> None:
    """Write the file, and print what it is."""
    if run is None:
        raise ValueError("expected the folder of a run, a policy file or a zip of stable-baselines3; see --help")
    if run in policies.POLICIES and run != universal.NAME:
        raise ValueError(f"policy {run}: expected the folder of a run, or universal with a body")
    outputs.check_folders("runner")
    path = Path(run)
    name = policy_name(run)
    folder = path if path.is_dir() else path.parent
    output = Path(FLAGS.output or folder / "policy.onnx")
    outputs.check_extension(output, [".onnx"])
    files.check_target(FLAGS.output)
    policy = _read_policy(run, name)
    training = _training_setup(path)
    if FLAGS.runner is not None:
        if FLAGS.output is not None:
            raise ValueError(f"--output {FLAGS.output}: goes without --runner, which names a folder")
        notes = runner_files.save(FLAGS.runner, policy, training)
        print(f"wrote {FLAGS.runner}: {', '.join(runner_files.FILES)}; {policy.size} observations", *notes, sep="\n")
        return
    onnx_file.save(output, policy, training)
    print(f"wrote {output}: {policy.size} observations, {policy.joints} actions, {output.stat().st_size} bytes")


def _training_setup(policy: Path) -> Setup | None:
    """Return the setup in which the policy of a run learned; None for a policy that is of no run.

    Args:
        policy: folder of a run, that of its best policy or of a checkpoint, or the policy file in one of them.

    Raises:
        ValueError: a damaged configuration.
    """
    folder = policy.absolute()
    if folder.name == network.FILE:
        folder = folder.parent
    folders = [folder]
    if folder.name == best.FOLDER:
        folders.append(folder.parent)
    if folder.parent.name == checkpoints.FOLDER:
        folders.append(folder.parents[1])
    run = next(filter(run_folder.is_begun, folders), None)
    if run is None:
        return None
    # The algorithm may be of a package that is not imported: an export needs only the settings.
    training = checks.mapping("training", run_folder.read_config(run).get("training", {}))
    return configuration.apply_training(network.load(policy).setup, training)


def _read_policy(run: str, name: str) -> Network:
    """Return the network to export: that of a run, or one of many bodies for the body and task of the flags.

    Args:
        run: folder of a run, a policy file or a zip.
        name: the same with the statistics of --vecnormalize.

    Raises:
        ValueError: flags that do not fit the policy.
        OSError: a file cannot be read.
    """
    has_body = FLAGS["robot"].present or custom_body() is not None
    has_task = any(FLAGS[flag].present for flag in ("task", "set", "arena"))
    # First: these import the modules that flags name.
    body = only_body() if has_body else None
    task, settings = task_from_flags()
    trained = policy_setup(run) if has_body or has_task else None
    if trained is not None and not trained.several:
        kept_settings = trained.task_kwargs | settings
        flagged_setup = Setup.of(body or trained.body, task if FLAGS["task"].present else trained.task, kept_settings)
        if flagged_setup != trained:
            raise ValueError(f"policy {run}: trained on {trained}, which an export keeps; got flags of {flagged_setup}")
        return policies.load_network(name)
    if body is not None:
        task, settings = complete_task(trained, task, settings)
        setup = Setup.of(body, task, settings)
        return universal.for_body(universal.load(name, setup.definition), setup)
    if run == universal.NAME:
        raise ValueError(f"policy {run}: expected a body for it, --robot, --spec or --legs")
    if has_task:
        raise ValueError(f"policy {run}: --task, --set and --arena go with the body of a policy of many bodies")
    with hint_import(NAMING_FLAGS):
        return policies.load_network(name)
