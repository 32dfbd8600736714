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
    """Settings of the rows of a table: those of every body, and each leg of its left side limp."""
    legs = [index for index, leg in enumerate(body.legs) if leg.foot_position[1] > 0.0]
    return [*MODIFIERS, *({"actuator_failure": leg} for leg in legs)]


def episodes(task: str, body, settings: dict, policy: str, preset: str, command=None) -> dict[str, np.ndarray]:
    """Figures of episodes, (episodes,) each: return, the task's own at the end, and the distance ahead."""
    count = FLAGS.episodes
    rows = VectorEnv(body, task, count, autoreset_mode="Disabled", max_episode_steps=FLAGS.steps, task_kwargs=settings)
    acting = policies.policy(policy, body, preset, count, task=rows.task.definition)
    seeds = range(FLAGS.seed, FLAGS.seed + count)
    places = []  # (7,) of all torsos, after the reset and every step

    def watch(playing, terminated):
        if not places and command is not None:
            rows.command("command", command)
        places.append(rows.batch.data.qpos[:, :7].copy())

    with contextlib.closing(rows):
        played = evaluation.episodes_in_batch(rows, acting, seeds, watch)
    first, last = places[0], places[-1]
    way = rotations.to_heading_frame(last[:, :2] - first[:, :2], rotations.yaw(first[:, 3:]))
    asked = rows.task.definition.parameters.target_velocity * rows.task.scene.control_timestep * FLAGS.steps
    totals = np.array([episode.total for episode in played])
    figures = {name: np.array([episode.progress[name] for episode in played]) for name in played[0].progress}
    return {"return": totals, "distance": way[:, 0] / asked, **figures}


def line(first: str, cells) -> str:
    """A row of a Markdown table."""
    return f"| {first} | {' | '.join(cells)} |"


def main() -> None:
    """Print a table for each robot."""
    robots = {name: registry.body_of(name) for name in FLAGS.robots}
    for body, preset in itertools.product(robots.values(), FLAGS.presets):
        checks.name(preset, presets_of(body), "preset")
    for name, body in robots.items():
        print(line(name, FLAGS.presets), line("---", ["---"] * len(FLAGS.presets)), sep="\n")
        for settings in program.progress(modifiers(body), desc=name, leave=False):
            played = [episodes("steer", body, settings, "cpg", preset, AHEAD) for preset in FLAGS.presets]
            cells = [f"{p['distance'].mean():.2f} ({p['fell'].mean():.0%})" for p in played]
            words = ", ".join(f"{key} {value}" for key, value in settings.items()) or "none"
            print(line(words, cells), flush=True)
        print()


if __name__ == "__main__":
    program.run(main)
