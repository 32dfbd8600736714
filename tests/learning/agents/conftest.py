"""What tests of agents share: a small dataset of prior data, and learners on a stage of their own."""

import importlib.util
import os

os.environ.setdefault("NPROC", "1")  # one thread, as the program does; read when JAX is imported
os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false")

import inspect

import pytest

from arc_suite import data, usage
from arc_suite.envs.setup import Setup
from arc_suite.learning.agents import algorithms
from arc_suite.learning.agents.configuration import Configuration

SMALL = {"hidden": 16, "batch": 8, "start_steps": 20}
SHORT = {"time_limit": 2.0}  # s: episodes of 40 steps
PHASES = {"phase_every": 100, "phase_updates": 60, "check_every": 20, "patience": 40, "scored_batches": 1}
FEW = {"num_envs": 10, "utd_ratio": 0.2}


def small(name, **changes):
    """Hyperparameters of small networks, batches and phases, and of few environments."""
    hp = algorithms.algorithm(name).hyperparameters
    return SMALL | (PHASES if hp.phase_updates else {}) | (FEW if hp.num_envs > 1 else {}) | changes


class Learning:
    """A learner's generator; the attributes are the local variables of `learn` after the latest slice.

    Those of soft actor-critic are in its run and in the updates of it.
    """

    def __init__(self, slices, steps=0):
        self.slices, self.latest = slices, None
        self.usage, self.step = usage.Usage("test", environment_steps=steps), steps

    def advance(self):
        """Learn a slice, and return it."""
        with usage.record(self.usage):
            self.latest = next(self.slices)
        if self.latest.is_complete:
            self.step = self.usage.steps
        return self.latest

    def until(self, step):
        """Learn up to an environment step, phases included, and return the latest slice."""
        while self.latest is None or self.step < step:
            self.advance()
        return self.latest

    def __getattr__(self, name):
        variables = inspect.getgeneratorlocals(self.slices)
        if "all_slices" not in variables:
            return variables[name]
        variables = inspect.getgeneratorlocals(variables["all_slices"])
        if name in ("state", "sums", "update_hp"):
            return getattr(variables["updates"], f"_{name}")
        if name == "task":
            return variables["environments"].tasks[0]
        if name == "environment":
            return variables["environments"]._groups[0][1]
        return getattr(variables["runs"][0], name)


def learning(algorithm, hyperparameters, folder, setup, steps=10_000, evaluate_every=1, steps_before=0, **context):
    """Begin to learn; slices end after every step unless told otherwise."""
    of_run = {name: context.pop(name) for name in ("seed", "prior", "training") if name in context}
    run = Configuration.of(setup, algorithm, hyperparameters, steps=steps, evaluate_every=evaluate_every, **of_run)
    return Learning(run.definition.learn(run.hyperparameters, run.context(folder, **context)), steps_before)


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
    settings = data.DatasetSettings(Setup.of("tick", "walk", SHORT), "cpg", ("medium",))
    data.collect(settings.dataset_id(), settings, 30, num_envs=15, threads=1)
    yield settings.dataset_id()
    patch.undo()


@pytest.fixture
def learner(tmp_path, prior):
    """A function that begins to learn by an algorithm, with changed hyperparameters."""

    def begin(name, hyperparameters, **context):
        needs = algorithms.algorithm(name).hyperparameters.prior != "none"
        context = {"folder": tmp_path / "run", "prior": prior if needs else None} | context
        context = {"setup": Setup.of("tick", "walk", SHORT)} | context
        return learning(name, hyperparameters, **context)

    return begin
