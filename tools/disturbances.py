"""Measures how demonstrators fare under modifiers: how far they walk straight ahead, and how many fall.

Each figure is the way along the first heading as a share of that at the target velocity, over whole
episodes, with the share of episodes that ended in a fall in brackets. `tools/results.py` measures tasks as they are.

Example:
  python tools/disturbances.py --robots tick,leaper --episodes 10 --steps 400
"""

import contextlib
import itertools

import numpy as np
from absl import flags

from arc_suite import checks, evaluation, policies, registry, rotations
from arc_suite.cli import program
from arc_suite.cpg.selection import presets_of
from arc_suite.envs.vector import VectorEnv
from arc_suite.robots import ROBOTS

FLAGS = flags.FLAGS
flags.DEFINE_list("robots", list(ROBOTS), "Who walks.")
flags.DEFINE_list("presets", ["tuned", "steered", "surefooted"], "Of the demonstrator.")
flags.DEFINE_integer("episodes", 10, "How many of each.", lower_bound=1)
flags.DEFINE_integer("steps", 400, "Control steps of an episode.", lower_bound=1)
flags.DEFINE_integer("seed", 0, "Of the first episode.", lower_bound=0)

AHEAD = (1.0, 0.0, 0.0)  # the command at the target velocity

MODIFIERS = [
    {},
    *({"kicks": size} for size in (0.5, 1.0, 1.5)),
    *({"motor_strength": share} for share in (0.6, 0.4, 0.25)),
    *({"friction": share} for share in (0.4, 0.2)),
    *({"mass": share} for share in (1.5, 2.5)),
    *({"payload": share} for share in (0.25, 0.5)),
    {"center_of_mass": 0.2},
    {"joint_offset": 0.1},
    {"joint_strength": (0.25, 1.0)},
    *({"force": share} for share in (0.5, 1.0)),
]


def modifiers(body) -> list[dict]:
    """Return the settings of the rows of a table: those of every body, and a failure of each leg on the left."""
    legs = [index for index, leg in enumerate(body.legs) if leg.foot_position[1] > 0.0]
    return [*MODIFIERS, *({"actuator_failure": leg} for leg in legs)]


def measure(body, settings: dict, preset: str) -> dict[str, np.ndarray]:
    """Return the distance ahead, as a share, and the task's figures at the end of episodes, (episodes,) each."""
    count = FLAGS.episodes
    steps = FLAGS.steps
    environment = VectorEnv(
        body, "steer", count, autoreset_mode="Disabled", max_episode_steps=steps, task_kwargs=settings
    )
    policy = policies.policy("cpg", body, preset, count, task=environment.task.definition)
    seeds = range(FLAGS.seed, FLAGS.seed + count)
    poses = []  # (episodes, 7) of torsos, after the reset and after each step

    def record_pose(playing, terminated):
        is_reset = not poses
        if is_reset:
            environment.command("command", AHEAD)
        poses.append(environment.batch.data.qpos[:, :7].copy())

    with contextlib.closing(environment):
        episodes = evaluation.episodes_in_batch(environment, policy, seeds, record_pose)
    displacement = poses[-1][:, :2] - poses[0][:, :2]
    distance = rotations.to_heading_frame(displacement, rotations.yaw(poses[0][:, 3:]))[:, 0]  # m
    task = environment.task
    distance_at_target_velocity = task.definition.parameters.target_velocity * task.scene.control_timestep * steps
    figures = {name: np.array([episode.progress[name] for episode in episodes]) for name in episodes[0].progress}
    return {"distance": distance / distance_at_target_velocity, **figures}


def table_row(head: str, cells) -> str:
    """Return a row of a Markdown table."""
    return f"| {head} | {' | '.join(cells)} |"


def main() -> None:
    """Print a table for each robot."""
    robots = {name: registry.body_of(name) for name in FLAGS.robots}
    for body, preset in itertools.product(robots.values(), FLAGS.presets):
        checks.name(preset, presets_of(body), "preset")
    for name, body in robots.items():
        print(table_row(name, FLAGS.presets))
        print(table_row("---", ["---"] * len(FLAGS.presets)))
        for settings in program.progress(modifiers(body), desc=name, leave=False):
            figures_of_presets = [measure(body, settings, preset) for preset in FLAGS.presets]
            cells = [
                f"{figures['distance'].mean():.2f} ({figures['fell'].mean():.0%})" for figures in figures_of_presets
            ]
            settings_text = ", ".join(f"{key} {value}" for key, value in settings.items()) or "none"
            print(table_row(settings_text, cells), flush=True)
        print()


if __name__ == "__main__":
    program.run(main)
