"""Measures worlds of `arc_suite.learning.worlds.mjx` on this machine's accelerator, and writes tables into docs/gpu.md.

Prints control steps a second, memory and compile time, whole episodes against a processor's, and the minutes in which
PPO earns what the demonstrator `medium` does. Needs the extras `learn` and `gpu`.

Example:
  python tools/bench_gpu.py --document docs/gpu.md
  python tools/bench_gpu.py --robots leaper --worlds 8 --impl jax --episodes 0 --learn ""
"""

import contextlib
import os
import pathlib
import re
import tempfile
import time

os.environ.setdefault("XLA_PYTHON_CLIENT_PREALLOCATE", "false")  # so that peaks are those of the program

import jax
import jax.numpy as jnp
import numpy as np
from absl import flags

from arc_suite import checks, evaluation, files, versions
from arc_suite.cli import program
from arc_suite.cpg import Demonstrator
from arc_suite.cpg.selection import law, presets_of
from arc_suite.envs.setup import Setup
from arc_suite.learning.agents import run_folder
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.learning.agents.training import train
from arc_suite.learning.worlds import device, mjx
from arc_suite.robots import ROBOTS

FLAGS = flags.FLAGS
flags.DEFINE_list("robots", list(ROBOTS), "Whose walks.")
flags.DEFINE_list("worlds", ["4096", "16384", "65536"], "Numbers of worlds that step together.")
flags.DEFINE_list("impl", list(device.IMPLEMENTATIONS), "Implementations.")
flags.DEFINE_integer("steps", 50, "Control steps of a measurement.", lower_bound=1)
flags.DEFINE_integer("episodes", 256, "Episodes that are compared with a processor's; 0 for none.", lower_bound=0)
flags.DEFINE_list("learn", ["warp"], "Simulations in which PPO learns: mjx, warp, or none.")
flags.DEFINE_string("document", None, "A Markdown file between whose <!-- gpu --> marks to put the tables.")

_MARKED = re.compile(r"(<!-- gpu -->\n).*?(<!-- end of gpu -->)", re.DOTALL)
# Of PPO in thousands of worlds.
LEARNING = {"num_envs": 4096, "horizon": 16, "minibatch": 16_384}


class Reached(Exception):
    """A learner has earned what was asked."""


def walk(env, preset, steps):
    """A compiled walk from a state and a demonstrator's mind, and these.

    It returns both after the steps, and rewards (steps, worlds), overflows (steps,) and done (steps, worlds).
    """
    made = law(env.task, presets_of(env.task.scene.body)[preset])

    def step(carry, _):
        state, mind = carry
        mind, action = made(mind, env.task.split(state.obs))
        state = jax.vmap(env.step)(state, action)
        return (state, mind), (state.reward, state.metrics["overflow"].sum(), state.done)

    walked = jax.jit(lambda carry: jax.lax.scan(step, carry, length=steps))
    state = jax.jit(jax.vmap(env.start))(jnp.arange(env.num_envs))
    return walked, (state, jax.tree.map(jnp.asarray, made.initial(env.num_envs)))


def speed(robot, impl, worlds, steps):
    """Row of a table: worlds, control steps a second, s of compiling, peak memory of the device, overflows."""
    walked, carry = walk(mjx.load(robot, "walk", impl=impl, num_envs=worlds), "medium", steps)
    began = time.perf_counter()
    walked = walked.lower(carry).compile()
    compiling = time.perf_counter() - began
    carry, _ = jax.block_until_ready(walked(carry))  # Warp compiles its kernels
    began = time.perf_counter()
    _, (_, overflows, _) = jax.block_until_ready(walked(carry))
    rate = worlds * steps / (time.perf_counter() - began)
    peak = (jax.local_devices()[0].memory_stats() or {}).get("peak_bytes_in_use")
    memory = f"{peak / 2**30:.1f} GiB" if peak else "not measured"
    return [robot, impl, f"{worlds}", f"{rate:,.0f}", f"{compiling:.0f} s", memory, f"{int(overflows.sum())}"]


def episodes(robot, impl, count):
    """Row of a table: mean returns of whole `tuned` episodes there and on a processor, and their falls."""
    env = mjx.load(robot, "walk", impl=impl, num_starts=count, num_envs=count)
    walked, carry = walk(env, "tuned", int(env.episode_length))
    (_, _), (rewards, _, done) = walked(carry)
    total, falls = np.asarray(rewards).sum(axis=0), int(np.asarray(done).any(axis=0).sum())
    with contextlib.closing(Setup.of(robot).make_vec(count, autoreset_mode="Disabled")) as environment:
        policy = Demonstrator(environment, "tuned")
        found = evaluation.episodes_in_batch(environment, policy, range(count))
    theirs = np.array([episode.total for episode in found])
    apart = 100.0 * (total.mean() / theirs.mean() - 1.0)
    return [robot, impl, f"{total.mean():.1f}", f"{theirs.mean():.1f}", f"{apart:+.2f} %", f"{falls}"]


def minutes(robot, simulation):
    """Row of a table: minutes and control steps after which PPO earns what `medium` does, evaluations counted."""
    setup = Setup.of(robot)
    with contextlib.closing(setup.make_vec(evaluation.CURVE_EPISODES, autoreset_mode="Disabled")) as environment:
        medium = Demonstrator(environment, "medium")
        goal = np.mean([episode.total for episode in evaluation.episodes_in_batch(environment, medium)])
    run = Configuration.of(setup, "ppo", {"simulation": simulation, **LEARNING}, steps=50_000_000, evaluate_every=10**6)
    reached, began = [], time.perf_counter()

    def on_metrics(step, metrics):
        if metrics.get("return", -np.inf) >= goal:
            reached.append((step, (time.perf_counter() - began) / 60.0))
            raise Reached

    with tempfile.TemporaryDirectory() as folder:
        with contextlib.suppress(Reached):
            train(run, pathlib.Path(folder), progress=program.progress, on_metrics=on_metrics)
        latest = run_folder.latest_returns(run_folder.table(folder, "evaluations")).mean()
    step, took = reached[0] if reached else (run.steps, None)
    spent = "not reached" if took is None else f"{took:.1f}"
    return [robot, simulation, f"{goal:.0f}", f"{latest:.0f}", f"{step / 1e6:.1f} M", spent]


def table(header, rows):
    """A Markdown table."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def main():
    """Measures, prints and writes."""
    robots = [checks.name(robot, ROBOTS, "robot") for robot in FLAGS.robots]
    impls = [device.implementation(impl) for impl in FLAGS.impl]
    if FLAGS.document and jax.default_backend() != "gpu":
        raise ValueError(f"--document: JAX finds no GPU here, and tables of a {jax.default_backend()} are not written")
    packages = ("mujoco", "mujoco-mjx", "warp-lang", "jax")
    found = ", ".join(f"{name} {versions.version_of(name)}" for name in packages)
    rows = [speed(robot, impl, int(count), FLAGS.steps) for robot in robots for impl in impls for count in FLAGS.worlds]
    header = ["robot", "impl", "worlds", "control steps/s", "compiling", "peak memory", "overflows"]
    parts = [f"{jax.devices()[0].device_kind}; {found}.", "<!-- table -->", table(header, rows)]
    if FLAGS.episodes:
        rows = [episodes(robot, impl, FLAGS.episodes) for robot in robots for impl in impls]
        parts.append(table(["robot", "impl", "return", "on a processor", "apart", "falls"], rows))
    if learners := [name for name in FLAGS.learn if name]:
        rows = [minutes(robot, simulation) for robot in robots for simulation in learners]
        parts.append(table(["robot", "simulation", "`medium`", "PPO", "control steps", "minutes"], rows))
    text = "\n\n".join([*parts, "<!-- end -->"])
    print(text)
    if FLAGS.document:
        path = pathlib.Path(FLAGS.document)
        page = path.read_text(encoding="utf-8")
        files.write(path, _MARKED.sub(lambda match: f"{match[1]}{text}\n{match[2]}", page))


if __name__ == "__main__":
    program.run(main)
