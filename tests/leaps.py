"""Who leaps over trenches and hurdles: `make check-leaps`, ten minutes or more.

python tests/leaps.py [NUMBER OF RANDOM BODIES [THEIR AGILITY]]

Prints for each body how far feet get ahead in a leap, how far the torso moves in the air, and how high the lowest
foot is then, in standing heights; then in how many of ten episodes `sighted` and `leaping` cross a trench of 0.8 h
and a hurdle of 0.2 h. Fails if Queen crosses fewer than eight times, or fewer than three quarters of the random
bodies do.
"""

import sys
import warnings

import numpy as np
from tqdm import tqdm

from arc_suite.arenas import terrain
from arc_suite.bodies.families import sound_body
from arc_suite.cpg import Demonstrator
from arc_suite.envs.vector import VectorEnv
from arc_suite.models.standing import measure_standing
from arc_suite.robots import ROBOTS

TRENCH, HURDLE = 0.8, 0.2  # standing heights
EPISODES, ENOUGH, BODIES, SHARE = 10, 8, 40, 0.75
FIRST = 7000  # seed of the first random body, of those that nothing else uses
PATIENCE = 1.8  # times the duration of the way at the target velocity


def drawn(environment: VectorEnv, kind: str) -> list[int]:
    """Return seeds of episodes on lanes of a kind."""
    arena, seeds, first = environment.task.definition.scene.arena, [], 0
    while len(seeds) < environment.num_envs:
        tried = range(first, first := first + environment.num_envs)
        environment.reset(seed=list(tried))
        lanes = np.rint(environment._memory.ground.center_y / (terrain.WIDTH * arena.unit)).astype(int)
        lanes += len(arena.lanes) // 2
        seeds += [seed for seed, lane in zip(tried, lanes, strict=True) if arena.lanes[lane][0] == kind]
    return seeds[: environment.num_envs]


def crossed(body, kind: str, preset: str) -> int:
    """Return in how many episodes all feet get behind the first trench or hurdle."""
    height = body.torso.standing_height
    size = {"width": TRENCH * height} if kind == "trenches" else {"rise": HURDLE * height}
    environment = VectorEnv(body, "leap", EPISODES, 1, "Disabled", task_kwargs=size)
    observation, _ = environment.reset(seed=drawn(environment, kind))
    task, lanes = environment.task.definition, environment._memory.ground.center_y
    x = np.tile(height * np.arange(0.0, 30.0, 0.02), (EPISODES, 1))
    uneven = task.scene.arena.height(x, np.tile(lanes[:, None], (1, x.shape[1]))) != 0.0
    first = uneven.argmax(axis=1)
    ends = [start + np.argmin(places[start:]) for places, start in zip(uneven, first, strict=True)]
    goals = x[0, ends] - measure_standing(body).soles[:, 0].min() + 0.2 * height
    pace = task.parameters.target_velocity * task.scene.control_timestep
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of bodies that cannot leap
        policy = Demonstrator(environment, preset)
    done, over = np.zeros(EPISODES, bool), np.zeros(EPISODES, bool)
    for _ in range(int(PATIENCE * goals.max() / pace)):
        observation, _, terminated, truncated, _ = environment.step(policy.act(environment.task.split(observation)))
        done |= ~over & ~terminated & (environment.batch.data.qpos[:, 0] > goals)
        over |= terminated | truncated
        if (done | over).all():
            break
    environment.close()
    return int(done.sum())


def flight(body):
    """Return what the leap of a body does on level ground."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        environment = VectorEnv(body, "leap", 1, 1)
        return Demonstrator(environment, "leaping").law.flight


def main(count: int = BODIES, agility: float = 1.0) -> bool:
    """Print the table, and return whether enough bodies cross trenches."""
    print("| body | feet ahead | in the air | clearance | trench: sighted | leaping | hurdle: sighted | leaping |")
    print("|---|---|---|---|---|---|---|---|", flush=True)
    found = {}
    random = [sound_body(seed).replace(agility=agility) for seed in range(FIRST, FIRST + count)]
    for body in tqdm([*ROBOTS.values(), *random], disable=None):
        told = flight(body)
        counts = [crossed(body, kind, preset) for kind in ("trenches", "hurdles") for preset in ("sighted", "leaping")]
        measures = (told.landed * told.distance, told.landed * told.torso_distance, told.clearance)
        print(f"| {body.name} | {' | '.join([*(f'{each:.2f}' for each in measures), *map(str, counts)])} |", flush=True)
        found[body.name] = counts[1]
    passed = [number >= ENOUGH for name, number in found.items() if name not in ROBOTS]
    print(f"{sum(passed)} of {count} random bodies cross a trench in {ENOUGH} of {EPISODES} episodes or more")
    return found["queen"] >= ENOUGH and sum(passed) >= SHARE * count


if __name__ == "__main__":
    sys.exit(not main(*(convert(given) for convert, given in zip((int, float), sys.argv[1:], strict=False))))
