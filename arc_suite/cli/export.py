"""Write a trained policy as ONNX, for game engines and onnxruntime.

The normaliser is inside; the metadata hold the robot, the observation's blocks, the control step, the
gears of the motors and the rule of the gait's clock.

  arc-suite export runs/tick-walk-sac-0
  arc-suite export runs/tick-walk-sac-0 -o tick.onnx
  arc-suite export ppo.zip

A zip of stable-baselines3 must have been trained in arc_suite.envs.sb3.VecEnv: then it holds its robot and task.
Demonstrators and functions of one's own are not networks, and are not exported.
"""

from pathlib import Path

from absl import flags

from arc_suite import policies
from arc_suite.cli.flags import define_vecnormalize, policy_name
from arc_suite.policies import onnx_file

FLAGS = flags.FLAGS
define_vecnormalize()
flags.DEFINE_string("output", None, "File to write. [default: policy.onnx next to the policy]", short_name="o")


def main(run: str | None = None) -> None:
    """Write the file, and print what it is."""
    if run is None:
        raise ValueError("expected the folder of a run, a policy file or a zip of stable-baselines3; see --help")
    policy = policies.trained(policy_name(run))
    source = Path(run)
    output = Path(FLAGS.output or (source if source.is_dir() else source.parent) / "policy.onnx")
    onnx_file.save(output, policy)
    print(f"wrote {output}: {policy.size} observations, {policy.joints} actions, {output.stat().st_size} bytes")
