"""Proximal policy optimization."""

import dataclasses
import shutil

import numpy as np
import pytest
from conftest import learning
from numpy.testing import assert_allclose, assert_array_equal
from refusals import refused

pytest.importorskip("jax", reason="of the extra learn: make check-agents")

import jax

import arc_suite
from arc_suite.bodies import generator
from arc_suite.envs.setup import Setup
from arc_suite.envs.vector import VectorEnv
from arc_suite.learning.agents import architectures, on_policy, run_folder
from arc_suite.learning.agents import proximal_policy as ppo
from arc_suite.learning.agents.architectures import Perceptron
from arc_suite.learning.agents.configuration import Configuration, with_network_of_folder
from arc_suite.learning.agents.hyperparameters import ProximalPolicy
from arc_suite.learning.agents.normalizer import Moments
from arc_suite.learning.agents.training import train
from arc_suite.policies import network
from arc_suite.robots import ROBOTS
from arc_suite.tasks import command

CHANGES = {"num_envs": 4, "horizon": 8, "minibatch": 16, "epochs": 2, "hidden": 16, "network": "perceptron"}
CHANGES |= {"schedule_steps": 1}  # that of the whole run
SIZES = Perceptron((6,), 3)
SMALL = ProximalPolicy(**CHANGES)


@pytest.fixture
def begun(tmp_path):
    """A function that begins to learn."""

    def begin(robot="leaper", task="walk", changes=(), steps=320, **context):
        context = {"setup": Setup.of(robot, task, context.pop("settings", None)), "seed": 3} | context
        algorithm = context.pop("algorithm", "ppo")
        return learning(algorithm, CHANGES | dict(changes), tmp_path, steps=steps, evaluate_every=steps, **context)

    return begin


def rolled_out(agent):
    """Transitions of a horizon from the latest slice on, and the batch that they make."""
    rollout = agent.collector.roll_out(agent.state.policy, agent.normalize, 0.3, 0, 0)
    return rollout, on_policy.batch_of(
        agent.hp, agent.collector.architecture, rollout, agent.state.values, agent.normalize, agent.symmetry
    )


def weights(tree):
    return np.concatenate([np.ravel(leaf) for leaf in jax.tree.leaves(tree)])


@pytest.fixture
def imitated(tmp_path):
    """The folder of a short run of DAgger."""
    changes = {"num_envs": 4, "round": 10, "left_out": 0, "hidden": 16, "batch": 64}
    setup = Setup.of("leaper", "walk", {"time_limit": 0.5})
    assert train(Configuration.of(setup, "dagger", changes, steps=80, evaluate_every=80), tmp_path / "imitated")
    return tmp_path / "imitated"


def test_advantages_are_discounted_sums_of_surprises_within_an_episode():
    hp = ProximalPolicy(discount=0.9, gae_lambda=0.8)
    random = np.random.default_rng(0)
    rewards, values, next_values = random.normal(size=(3, 12, 5))
    terminated = random.uniform(size=(12, 5)) < 0.15
    ended = terminated | (random.uniform(size=(12, 5)) < 0.15)
    assert (ended & ~terminated).any() and terminated.any()
    found = ppo.estimate_advantages(hp, rewards, values, next_values, terminated, ended)
    for step in range(12):
        for place in range(5):
            total, factor = 0.0, 1.0
            for later in range(step, 12):
                worth = 0.0 if terminated[later, place] else next_values[later, place]
                total += factor * (rewards[later, place] + 0.9 * worth - values[later, place])
                factor *= 0.9 * 0.8
                if ended[later, place]:
                    break
            assert found[step, place] == pytest.approx(total, abs=1e-12)


def batch(random, count=64, size=6, joints=3):
    arrays = random.normal(size=(count, size)), random.normal(size=(count, joints)), np.zeros((count, joints))
    return ppo.Horizon(*(array.astype(np.float32) for array in (*arrays, random.normal(size=count), np.ones(count))))


def test_the_policy_moves_towards_what_earned_more_and_values_towards_returns():
    hp, random = dataclasses.replace(SMALL, policy_rate=1e-3), np.random.default_rng(0)
    state = ppo.begin(hp, SIZES, random)
    given = batch(random)
    given = given._replace(means=np.asarray(ppo.predict_mean_actions(SIZES, state.policy, given.observations)))
    before = np.asarray(ppo.predict_values(SIZES, state.values, given.observations))
    orders = np.tile(np.arange(64), (30, 1))
    after, divergence, _ = ppo.update(hp, SIZES, state, given, orders, (np.float32(0.5), np.float32(0.01)), True)
    moved = np.asarray(ppo.predict_mean_actions(SIZES, after.policy, given.observations)) - given.means
    gained = (moved * (given.actions - given.means)).sum(axis=-1) * given.advantages
    assert gained.mean() > 0.0
    acted = moved[: hp.num_envs * hp.horizon]  # what follows are images
    assert divergence == pytest.approx((acted**2).sum(axis=-1).mean() / (2 * 0.5**2), rel=1e-3)
    values = np.asarray(ppo.predict_values(SIZES, after.values, given.observations))
    assert abs(values - 1.0).mean() < 0.8 * abs(before - 1.0).mean()


def test_nothing_is_gained_beyond_the_clip():
    """Where all ratios are beyond the clip on the side that pays, the policy has no gradient."""
    hp, random = dataclasses.replace(SMALL, clip=0.2), np.random.default_rng(0)
    state = ppo.begin(hp, SIZES, random)
    given = batch(random)
    means = np.asarray(ppo.predict_mean_actions(SIZES, state.policy, given.observations))
    given = given._replace(means=means + 1.0, actions=means, advantages=np.ones(64, np.float32))
    before = weights(state.policy)
    orders, numbers = np.arange(64)[None], (np.float32(0.5), np.float32(0.01))
    after, *_ = ppo.update(hp, SIZES, state, given, orders, numbers, True)
    assert_array_equal(weights(after.policy), before)


@pytest.mark.parametrize(("wanted", "factor"), [(1e-9, 1 / 1.5), (1e9, 1.5)])
def test_the_rate_follows_the_divergence(wanted, factor):
    random = np.random.default_rng(0)
    state, given = ppo.begin(SMALL, SIZES, random), batch(random)
    orders, numbers = np.arange(64)[None], (np.float32(0.5), np.float32(wanted))
    after, *_ = ppo.update(SMALL, SIZES, state, given, orders, numbers, True)
    assert after.rate == pytest.approx(SMALL.policy_rate * factor)


STUMBLING = {"healthy_range": (0.22, 10.0)}  # m: episodes of a few steps


@pytest.mark.parametrize(("task", "settings"), [("walk", None), ("steer", None), ("walk", STUMBLING)])
def test_it_resumes_bit_exactly(begun, task, settings):
    whole, first = (begun("tick", task, settings=settings) for _ in range(2))
    arrays = {name: array.copy() for name, array in first.until(128).checkpoint.items()}
    second = begun("tick", task, checkpoint=arrays, steps_before=128, settings=settings)
    for name, array in whole.until(320).checkpoint.items():
        assert_array_equal(second.until(320).checkpoint[name], array, err_msg=name)


def test_a_new_command_cuts_the_returns(begun, monkeypatch):
    """The step that begins it bootstraps from the observation before."""
    monkeypatch.setattr(command, "SHORTEST", 3)
    monkeypatch.setattr(command, "LONGEST", 6)
    agent = begun("tick", "steer", {"horizon": 24})
    agent.advance()
    rollout, _ = rolled_out(agent)
    split = agent.collector.environment.task.split
    here, there = (split(rollout[name])["command"][..., :3] for name in ("observations", "next_observations"))
    assert_array_equal(there, here)
    new = (here[1:] != here[:-1]).any(axis=-1)
    assert rollout["ended"][:-1][new].all()
    drawn = new & ~rollout["terminated"][:-1]
    assert drawn.sum() > 8
    before, after = (rollout[name][:-1] for name in ("observations", "next_observations"))
    assert_array_equal(before[drawn], after[drawn])
    # A stop may follow a stop, and is another command, too.
    moving = ~new & here[:-1].any(axis=-1)
    assert not rollout["ended"][:-1][moving].any()
    assert (before[moving] != after[moving]).any(axis=-1).all()


def test_a_step_that_diverges_bootstraps_from_the_observation_before(begun):
    agent = begun()
    agent.advance()
    agent.collector.environment.batch.data.qvel[1, 0] = 1e11
    rollout, _ = rolled_out(agent)
    assert rollout["ended"][0, 1] and not rollout["terminated"][0, 1] and rollout["rewards"][0, 1] == 0.0
    is_same = (rollout["next_observations"][0] == rollout["observations"][0]).all(axis=-1)
    assert_array_equal(np.flatnonzero(is_same), [1])


def test_blocks_of_the_observation_weigh_alike():
    architecture = Perceptron.of(Setup.of("tick", "steer").definition)
    squares = architecture.scale.astype(float) ** 2
    assert len(squares) == architecture.size and squares.mean() == pytest.approx(1.0)
    ends = np.cumsum(architecture.blocks)
    sums = [part.sum() for part in np.split(squares, ends[:-1])]
    assert_allclose(sums, architecture.size / len(architecture.blocks), rtol=1e-5)
    assert_array_equal(Perceptron((6,), 3).scale, np.ones(6))
    assert_array_equal(Perceptron((6, 0), 3).scale, np.ones(6))


def test_a_network_is_exported_and_imported_as_it_acts():
    architecture = Perceptron((2, 150, 6), 3)
    random = np.random.default_rng(0)
    parameters = architecture.draw_policy(random, 16)
    x = random.normal(size=(5, 158)).astype(np.float32)
    graph = architectures.policy_graph(architecture, Moments.empty(158).normalizer(), parameters)
    acted = graph(x)
    assert_allclose(acted, ppo.predict_mean_actions(architecture, parameters, x).clip(-1.0, 1.0), atol=1e-5)
    normalize, again = architectures.read_policy_graph(architecture, graph)
    assert_allclose(ppo.predict_mean_actions(architecture, again, normalize(x)).clip(-1.0, 1.0), acted, atol=1e-5)


def test_every_transition_has_a_mirrored_one(begun):
    agent = begun()
    agent.until(64)
    rollout, given = rolled_out(agent)
    assert len(given.returns) == 2 * 32
    for name in ("advantages", "returns"):
        both = np.asarray(getattr(given, name))
        assert_array_equal(both[:32], both[32:])
    for name in ("actions", "means"):
        both = np.asarray(getattr(given, name))
        assert_array_equal(agent.symmetry.action(both[:32]), both[32:])
    mirrored = agent.symmetry.observation(rollout["observations"].reshape(32, -1))
    assert_array_equal(agent.normalize(mirrored), given.observations[32:])
    # The normalizer has seen as much of the left as of the right.
    assert_allclose(agent.symmetry.observation(agent.moments.mean), agent.moments.mean, atol=1e-9)


def test_a_body_without_symmetry_has_no_mirrored_transitions(begun):
    agent = begun(generator.random_body(10))
    agent.advance()
    assert len(rolled_out(agent)[1].returns) == 32


def test_time_limits_fall_on_different_steps_and_bootstrap(begun):
    agent = begun(settings={"time_limit": 0.4, "healthy_range": (-10.0, 10.0)}, steps=64)
    seen = []
    step = VectorEnv.step

    def recording(self, actions):
        result = step(self, actions)
        seen.append(result[2] | result[3])
        return result

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(VectorEnv, "step", recording)
        agent.advance()
    assert [np.flatnonzero(ended).tolist() for ended in np.array(seen).T] == [[7], [5], [3], [1]]
    rollout, given = rolled_out(agent)
    assert not rollout["terminated"].any()
    # After the last step of an episode comes its own last observation, not the next one's first.
    last = rollout["next_observations"][1, 3]
    assert rollout["ended"][1, 3] and not np.array_equal(last, rollout["observations"][2, 3])
    split = agent.collector.environment.task.split
    assert_allclose(split(rollout["observations"][2, 3])["gait_clock"], (0.0, 1.0))
    assert split(last)["gait_clock"][0] > 0.1
    value = np.asarray(
        ppo.predict_values(agent.collector.architecture, agent.state.values, agent.normalize(last[None]))
    )[0]
    expected = (1.0 - agent.hp.discount) * rollout["rewards"][1, 3] + agent.hp.discount * value
    assert np.asarray(given.returns)[:32].reshape(8, 4)[1, 3] == pytest.approx(expected, rel=1e-5)


def test_schedules(begun):
    """The standard deviation falls, and the normalizer stays from a part of the run on."""
    agent = begun(changes={"normalize_until": 0.5})
    assert agent.advance().metrics["std"] == SMALL.initial_std
    before = agent.until(192).policy.arrays["0"]  # the mean
    assert_array_equal(agent.until(320).policy.arrays["0"], before)
    ratio = SMALL.final_std / SMALL.initial_std
    assert agent.latest.metrics["std"] == pytest.approx(SMALL.initial_std * ratio**0.9)


def test_it_starts_from_a_policy_with_a_warm_up_of_the_values(begun, imitated):
    changes = {"start": str(imitated), "value_warm_up": 16}
    agent, start = begun(changes=changes, algorithm="finetune"), network.load(imitated)
    observations = np.random.default_rng(0).normal(size=(5, sum(start.blocks.values()))).astype(np.float32)
    values = None
    for _ in range(2):  # the warm-up
        latest = agent.advance()
        assert_array_equal(latest.policy(observations), start.actions(observations))
        assert values is None or (weights(agent.state.values) != values).mean() > 0.3  # some inputs never move
        values = weights(agent.state.values)
    latest = agent.advance()
    (weight, *_), (mean, *_) = (
        [name for name in node.inputs if name in start.graph.arrays]
        for node in (start.graph.nodes[3], start.graph.nodes[0])
    )
    assert not np.array_equal(latest.policy.arrays[weight], start.graph.arrays[weight])
    assert_array_equal(latest.policy.arrays[mean], start.graph.arrays[mean])


def test_a_run_resumes_without_the_policy_that_it_started_from(tmp_path, imitated):
    changes = CHANGES | {"start": str(imitated), "value_warm_up": 8}
    setup = Setup.of("leaper", "walk", {"time_limit": 0.5})
    run, seen = Configuration.of(setup, "finetune", changes, steps=96, evaluate_every=32), []
    assert not train(run, tmp_path / "run", minutes=0.0)

    def interrupting(step, metrics):
        if step == 64:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(run, tmp_path / "run", on_metrics=interrupting)
    shutil.rmtree(imitated)
    assert train(run, tmp_path / "run", on_metrics=lambda step, metrics: seen.append(step))
    assert seen == [64, 64, 96, 96]


def test_a_run_whose_start_is_gone_has_the_network_of_its_folder(tmp_path, imitated):
    given_changes = {name: value for name, value in CHANGES.items() if name not in ("network", "hidden")}
    changes = given_changes | {"start": str(imitated), "value_warm_up": 0}
    settings = {"time_limit": 0.5}
    setup = Setup.of("leaper", "walk", settings)
    run = Configuration.of(setup, "finetune", changes, steps=64, evaluate_every=32)
    folder = tmp_path / "run"

    def stop(step, metrics):
        if step == 64:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(run, folder, on_metrics=stop)
    shutil.rmtree(imitated)
    without_start = Configuration.of(setup, "finetune", changes, steps=64, evaluate_every=32)
    assert without_start != run
    assert with_network_of_folder(without_start, folder) == run
    assert with_network_of_folder(without_start, tmp_path / "other") == without_start
    other = Configuration.of(setup, "finetune", changes | {"hidden": 32}, steps=64, evaluate_every=32)
    assert with_network_of_folder(other, folder).hyperparameters.hidden == 32
    options = {"steps": 64, "evaluate_every": 32, "folder": folder}
    arc_suite.learning.train("leaper", algorithm="finetune", task_kwargs=settings, hyperparameters=changes, **options)
    assert run_folder.read_progress(folder)["evaluated"] == 64


def test_a_start_that_does_not_fit_is_refused_in_one_line(begun, tmp_path, imitated):
    observations = "a policy of walk for other observations than those of steer: command has 0 numbers, and not 6"
    start = {"start": str(imitated)}
    for robot, task, changes, message in (
        ("leaper", "steer", start, f"{imitated}: {observations}"),
        ("leaper", "walk", start | {"hidden": 32}, f"{imitated}: expected 32 hidden units, got 16"),
        ("tick", "walk", start, f"policy {imitated}: made for leaper, and not for tick"),
        ("leaper", "walk", {"value_warm_up": 8}, "start: expected the folder of a run whose policy is where learning "),
    ):
        with refused(message, begins=True):
            begun(robot, task, changes, algorithm="finetune").advance()
    with pytest.raises(OSError, match="no such file"):
        begun(changes={"start": str(tmp_path / "none")}, algorithm="finetune").advance()


def test_a_learner_from_a_policy_needs_one(tmp_path):
    """Also without a warm-up of values: it would learn from nothing."""
    run = Configuration.of(Setup.of("leaper"), "finetune", CHANGES | {"value_warm_up": 0}, steps=32)
    with refused("start: expected the folder of a run whose policy is where learning starts, got none"):
        train(run, tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_a_start_of_a_learner_from_nothing_is_refused_with_the_learner_that_takes_it(begun):
    for robot, name in (("leaper", "finetune"), ("leaper,tick", "finetune_bodies")):
        message = f"start: expected none, as ppo learns from no policy; --algorithm {name} does, got 'runs/x'"
        with refused(message):
            begun(robot, changes={"start": "runs/x", "network": "legs"})


def test_hyperparameters_that_do_not_fit_are_refused():
    with refused("minibatch: expected at most the 64 transitions of a horizon, mirrored copies counted, got 65"):
        dataclasses.replace(SMALL, minibatch=65)
    with pytest.raises(ValueError, match=r"^num_envs: "):
        dataclasses.replace(SMALL, num_envs=0)


def test_a_minibatch_counts_mirrored_copies_that_there_are(begun):
    """An asymmetric body has none: a minibatch of more than the transitions made no update."""
    queen = ROBOTS["queen"]
    first_leg = dataclasses.replace(queen.legs[0], yaw_deg=queen.legs[0].yaw_deg + 10.0)
    asymmetric = Setup.of(dataclasses.replace(queen, legs=(first_leg, *queen.legs[1:])), "walk")
    with refused("minibatch: expected at most the 32 transitions of a horizon, got 64"):
        begun(changes={"minibatch": 64}, setup=asymmetric).advance()
    for setup, minibatch in ((asymmetric, 32), (Setup.of("queen", "walk"), 64)):
        agent = begun(changes={"minibatch": minibatch}, setup=setup)
        assert np.isfinite(agent.advance().metrics["value_loss"])


@pytest.mark.parametrize("steps", [100, 200, 400])
def test_a_schedule_spans_the_run_or_its_fewest_steps(steps):
    hp = dataclasses.replace(SMALL, num_envs=10, horizon=5, minibatch=50, schedule_steps=200)
    start, halfway, end = (on_policy.Schedules.of(hp, steps, count) for count in (0, steps // 100, steps // 50))
    assert start.std == hp.initial_std and start.desired_kl == hp.initial_desired_kl
    progress = min(steps / 200, 1.0)
    assert end.std == pytest.approx(hp.initial_std * (hp.final_std / hp.initial_std) ** progress)
    assert end.desired_kl == pytest.approx(
        hp.initial_desired_kl * (hp.final_desired_kl / hp.initial_desired_kl) ** progress
    )
    assert halfway.std == pytest.approx(np.sqrt(start.std * end.std))
    assert end.updates_normalizer == (steps == 100)


def test_runs_without_an_active_schedule_have_the_fields_of_before():
    """A run of an earlier version goes on where the schedule spans it anyway, and only there."""
    for steps, changes, is_in_file in (
        (199_999, {}, True),
        (200_000, {}, False),
        (200_000, {"schedule_steps": 1}, True),
    ):
        configuration = Configuration.of(Setup.of("tick"), "ppo", changes, steps=steps, evaluate_every=steps)
        fields = configuration.to_dict()
        assert ("schedule_steps" in fields["hyperparameters"]) == is_in_file
        assert Configuration.from_dict(fields) == configuration
    finetune = Configuration.of(Setup.of("tick"), "finetune", {"start": "runs/x"}, steps=100, evaluate_every=100)
    assert "schedule_steps" not in finetune.to_dict()["hyperparameters"]


@pytest.mark.long
def test_it_learns(begun):
    """Standing still on the way to walking, in a minute: falls end."""
    changes = {"num_envs": 32, "horizon": 16, "minibatch": 256, "hidden": 64, "epochs": 4}
    changes |= {"initial_desired_kl": 0.012, "final_desired_kl": 0.004}
    agent = begun("tick", changes=changes, steps=30_000)
    first, last = agent.advance().metrics, agent.until(30_000).metrics
    assert last["reward"] > first["reward"] + 0.1
    assert last["falls"] < first["falls"]


def test_a_run(tmp_path):
    setup = Setup.of("tick", "steer", {"time_limit": 0.5})
    assert train(Configuration.of(setup, "ppo", CHANGES, steps=64, evaluate_every=64), tmp_path / "run")
    assert len(run_folder.table(tmp_path / "run", "training")["reward"]) == 2
