"""What tests of agents share: a small dataset of prior data, and learners on a stage of their own."""

import importlib.util
import os

os.environ.setdefault("NPROC", "1")  # one thread, as the program does; read when JAX is imported
os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false")

import pytest

from arc_suite import data
from arc_suite.agents import algorithms
from arc_suite.agents.learner import Stage
from arc_suite.envs.setup import Setup
from arc_suite.robots import ROBOTS

SMALL = {"hidden": 16, "batch": 8, "random_steps": 20}
SHORT = {"time_limit": 2.0}  # s: episodes of 40 steps
PHASES = {"phase_every": 100, "phase_updates": 60, "check_every": 20, "patience": 40, "scored_batches": 1}


def small(name, **changes):
    """An algorithm of the table with small networks, batches and phases."""
    definition = algorithms.algorithm(name)
    phases = PHASES if definition.row.phase_updates else {}
    return definition.with_row(SMALL | phases | changes)


@pytest.fixture(autouse=True)
def single_precision():
    """As the program has it, whatever other tests of this process have set."""
    if importlib.util.find_spec("jax") is None:
        yield
        return
    import jax

    with jax.enable_x64(False):
        yield


@pytest.fixture(scope="session")
def prior(tmp_path_factory):
    """Id of a dataset of Tick, 30 episodes of 40 steps."""
    patch = pytest.MonkeyPatch()
    patch.setenv("MINARI_DATASETS_PATH", str(tmp_path_factory.mktemp("datasets")))
    settings = data.Settings(Setup.of("tick", "walk", SHORT), "cpg", ("medium",))
    data.collect(settings.dataset_id(), settings, 30, rows=15, threads=1)
    yield settings.dataset_id()
    patch.undo()


@pytest.fixture
def learner(tmp_path, prior):
    """A function that begins a learner of a definition."""

    def begin(definition, steps=10_000, seed=0, **stage):
        needs = definition.row.prior != "none"
        stage = {"folder": tmp_path / "run", "prior": prior if needs else None, "task_kwargs": SHORT} | stage
        return definition.module.begin(
            definition.row, Stage(body=ROBOTS["tick"], task="walk", seed=seed, steps=steps, **stage)
        )

    return begin
