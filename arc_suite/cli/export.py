"""Write a trained policy as ONNX, for game engines and onnxruntime.

The normaliser is inside; the metadata hold the robot, the observation's blocks, the control step, the
gears of the motors and the rule of the gait's clock.

  arc-suite export runs/tick-walk-sac-0
  arc-suite export runs/tick-walk-sac-0 -o tick.onnx
"""

from pathlib import Path

from absl import flags

from arc_suite.policies import network, onnx_file

FLAGS = flags.FLAGS
flags.DEFINE_string("output", None, "File to write. [default: policy.onnx in the folder of the run]", short_name="o")


def main(run: str | None = None) -> None:
    """Write the file, and print what it is."""
    if run is None:
        raise ValueError("expected the folder of a run; see --help")
    policy = network.load(run)
    source = Path(run)
    output = Path(FLAGS.output or (source if source.is_dir() else source.parent) / "policy.onnx")
    onnx_file.save(output, policy)
    print(f"wrote {output}: {policy.size} observations, {policy.joints} actions, {output.stat().st_size} bytes")
