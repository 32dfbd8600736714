"""Policies in files: what a network computes, alone and among others, and files that are none."""

import json
import os
import zipfile

import numpy as np
import pytest
from networks import drawn, made, of_many_bodies
from refusals import refused

import arc_suite
from arc_suite import evaluation, policies
from arc_suite.bodies import generator
from arc_suite.envs.setup import Setup
from arc_suite.envs.vector import VectorEnv
from arc_suite.evaluation import provenance
from arc_suite.policies import network
from arc_suite.policies.graph import OPERATORS, check_graph
from arc_suite.policies.tracing import traced
from arc_suite.robots import ROBOTS


@pytest.fixture
def saved(tmp_path):
    network.save(tmp_path / "policy.npz", made())
    return tmp_path


DAMAGED = r"policy\.npz: no policy, or a damaged one: "


def assert_refused(path, line):
    with pytest.raises(ValueError, match=line) as error:
        policies.policy(str(path), "tick")
    assert "\n" not in str(error.value) and len(str(error.value)) < 700


def rewritten(saved, name, change):
    """Change an array of the file, and return the file."""
    with np.load(saved / "policy.npz") as stored:
        arrays = dict(stored)
    np.savez(saved / "policy.npz", **arrays | {name: change(arrays[name])})
    return saved / "policy.npz"


def test_the_hash_is_that_of_what_a_policy_computes(saved):
    """Compression, times and the type of stored numbers do not count; a bit of a weight does."""
    path = saved / "policy.npz"
    before = policies.digest(str(path))
    with np.load(path) as stored:
        arrays = dict(stored)
    np.savez_compressed(path, **dict(reversed(arrays.items())))
    assert policies.digest(str(path)) == before == network.digest(made())
    name = next(name for name, array in arrays.items() if array.dtype == np.float32)
    half = arrays[name].astype(np.float16)
    digests = set()
    for numbers in (half, half.astype(np.float32)):
        np.savez(path, **arrays | {name: numbers})
        digests.add(policies.digest(str(path)))
    assert len(digests) == 1 and before not in digests
    other = arrays[name].copy()
    other.flat[0] = np.nextafter(other.flat[0], np.inf)
    np.savez(path, **arrays | {name: other})
    assert policies.digest(str(path)) not in {before, *digests}


def test_what_operators_compute():
    """Every operator, against the same in float64; truth values are 1 and 0."""
    numbers = drawn(1)
    x, other, weight, bias, scale, offset = (numbers(*shape) for shape in ((7, 5), (1, 5), (5, 4), (4,), (5,), (5,)))
    mask = (numbers(7, 5) > 0.0).astype(np.float32)
    rows, x64 = numbers(7, 5, 3), x.astype(float)
    centered = x64 - x64.mean(axis=1, keepdims=True)
    expected = {
        "Add": ((x, other), x64 + other),
        "Clip": ((x, np.float32(-0.5), np.float32(0.7)), x64.clip(-0.5, 0.7)),
        "Concat": ((x, rows, other), np.hstack([x64, rows.reshape(7, -1), np.repeat(other, 7, axis=0)])),
        "Div": ((x, other), x64 / other),
        "Elu": ((x,), np.where(x > 0.0, x64, np.exp(x64) - 1.0)),
        "Equal": ((mask, np.float32(1.0)), mask == 1.0),
        "Greater": ((x, other), x > other),
        "GreaterOrEqual": ((x, x), x >= x),
        "LayerNorm": ((x, scale, offset), centered / np.sqrt(x64.var(axis=1, keepdims=True) + 1e-5) * scale + offset),
        "Linear": ((x, weight, bias), x64 @ weight + bias),
        "Max": ((x, other), np.maximum(x64, other)),
        "Mul": ((x, other), x64 * other),
        "Neg": ((x,), -x64),
        "Pick": ((rows, mask), rows[mask > 0.0]),
        "Place": ((rows[mask > 0.0], mask), rows * mask[..., None]),
        "Product": ((x, weight), x64 @ weight),
        "Relu": ((x,), np.where(x > 0.0, x64, 0.0)),
        "Sqrt": ((abs(x),), np.sqrt(abs(x64))),
        "Sub": ((x, other), x64 - other),
        "Sum": ((rows,), rows.sum(axis=1, dtype=float)),
        "Take": ((rows, np.array([[0, 14], [3, 3]], np.int32)), rows.reshape(7, -1)[:, [[0, 14], [3, 3]]]),
        "Tanh": ((x,), np.tanh(x64)),
    }
    assert list(expected) == list(OPERATORS)
    for name, (inputs, result) in expected.items():
        found = OPERATORS[name].function(*inputs)
        assert found.dtype == np.float32, name
        np.testing.assert_allclose(found, result, atol=2e-6, rtol=1e-5, err_msg=name)


@pytest.mark.parametrize(
    ("function", "line"),
    [
        (lambda x: np.clip(x, -1.0, 1.0), "a graph does not compute np.clip; use x.clip(low, high)"),
        (lambda x: np.sum(x, axis=1), "a graph does not compute np.sum; use x.sum(axis)"),
        (lambda x: np.mean(x, axis=1), "a graph does not compute np.mean; use x.sum(axis) / count"),
        (lambda x: np.linalg.norm(x, axis=1), "a graph does not compute np.norm; there are: add, bitwise_and, "),
        (lambda x: np.exp(x), "a graph does not compute np.exp; there are: add, bitwise_and, bitwise_or, "),
        (lambda x: np.add.reduce(x, axis=1), "a graph does not compute np.add.reduce; there are: add, "),
        (lambda x: np.add(x, 1.0, where=False), "np.add of traced numbers takes no where"),
        (lambda x: x**2, "a graph does not compute np.power; use x * x"),
        (lambda x: x if x > 0.0 else -x, "traced numbers have no truth value: multiply by the comparison, which is 1 "),
        (lambda x: x[0] + 1.0, "expected a first axis of length 1, of environments, got shape (4,)"),
        (lambda x: np.zeros((1, 4)), "expected actions computed from the observations, got array([[0., 0., 0., 0.]])"),
    ],
)
def test_what_a_graph_does_not_compute_is_refused(function, line):
    with refused(line, begins=True):
        traced(function, 4)


def test_a_graph_computes_products_and_hyperbolic_tangents_as_numpy_writes_them():
    weight = np.arange(8.0).reshape(4, 2)
    graph = traced(lambda x: np.tanh(x @ weight), 4)
    assert [node.operator for node in graph.nodes] == ["Product", "Tanh"]


@pytest.mark.parametrize(
    "function",
    [
        lambda x: x.clip(-1, 1),
        lambda x: x.clip(0, 1),
        lambda x: x * 2,
        lambda x: 1 - x,
        lambda x: np.maximum(x, 0),
        lambda x: x.reshape(len(x), 3, 2).sum(1) / 3,
        lambda x: np.concatenate([x[:, :1], np.array([[1]])], axis=1),
        lambda x: x @ np.arange(12).reshape(6, 2),
        lambda x: (x > 0) * 2,
    ],
)
def test_integers_in_a_traced_function_are_numbers_as_others(function):
    graph = check_graph(traced(function, 6), 6)
    numbers = drawn(0)(1, 6)
    result = graph(numbers)
    assert result.dtype == np.float32
    np.testing.assert_allclose(result, function(numbers), rtol=1e-6)


def test_a_traced_function_computes_the_same_to_the_bit():
    def function(x):
        first, second = np.split(x.reshape(len(x), 3, 2), [1], axis=1)
        joined = np.stack([first[:, 0], -second[:, 1].clip(-0.5, 0.5)], axis=1)
        where = (joined >= 0.25) | ((joined == 0.0) & (joined > -1.0))
        spread = np.broadcast_to(joined.sum(axis=1)[:, None], joined.shape)
        return (np.maximum(np.sqrt(spread * spread), 2.0 * joined - 1.0) / 3.0 + where).reshape(len(x), -1)

    x = drawn(0)(5, 6)
    graph = traced(function, 6)
    np.testing.assert_array_equal(graph(x[:1]), function(x[:1]))
    np.testing.assert_array_equal(graph(x), np.concatenate([function(x[i : i + 1]) for i in range(5)]))


@pytest.mark.parametrize("num_envs", [1, 2, 10, 64, 65])
def test_an_environment_does_the_same_alone(num_envs):
    policy = made(hidden=256)
    observations = drawn(1)(num_envs, policy.size)
    alone = np.concatenate([policy.actions(observations[index : index + 1]) for index in range(num_envs)])
    assert np.array_equal(policy.actions(observations), alone)


@pytest.mark.parametrize("make", [made, of_many_bodies], ids=["one body", "many bodies"])
@pytest.mark.parametrize("name", ["policy.npz", "policy", "walk.policy", "WALK.NPZ"])
def test_comes_back_from_a_file_to_the_bit(tmp_path, make, name):
    network.save(tmp_path / name, policy := make())
    assert [path.name for path in tmp_path.iterdir()] == [name]
    again = network.load(tmp_path / name)
    hash_of_one = None if policy.setup.several else policy.setup.physics_sha256
    assert again[1:] == policy._replace(physics_sha256=hash_of_one)[1:]
    assert again.graph.nodes == policy.graph.nodes and again.graph.arrays.keys() == policy.graph.arrays.keys()
    for name, array in policy.graph.arrays.items():
        assert again.graph.arrays[name].tobytes() == array.tobytes()


@pytest.mark.parametrize("name", ["", "policy.npz"])
def test_is_a_policy_of_every_program(saved, name, monkeypatch):
    """By the folder of a run, or the file; in a batch and alone it does the same."""
    policy = policies.policy(str(saved / name), "tick")
    envs = VectorEnv("tick", "walk", 3, 1, "Disabled")
    alone = evaluation.episodes(arc_suite.load("tick", "walk"), policy, range(3))
    assert evaluation.episodes_in_batch(envs, policy, range(3)) == alone
    monkeypatch.chdir(saved.parent)
    assert policies.policy(saved.name, "tick").setup.robot == "tick"


def test_a_file_in_the_current_folder_may_have_no_extension(saved, monkeypatch):
    (saved / "policy.npz").rename(saved / "stroller")
    monkeypatch.chdir(saved)
    assert policies.policy("stroller", "tick").setup == policies.setup_of("stroller") == made().setup


def test_a_file_may_have_its_extension_in_capitals(saved, monkeypatch):
    (saved / "policy.npz").rename(saved / "WALK.NPZ")
    monkeypatch.chdir(saved)
    assert policies.policy("WALK.NPZ", "tick").setup.robot == "tick"
    assert policies.load_network("WALK.NPZ").setup.robot == "tick"
    assert provenance.policy_sha256("WALK.NPZ") == network.digest(made())


def test_of_another_body(saved):
    with pytest.raises(ValueError, match=r"^policy .*: made for tick, and not for queen$"):
        policies.policy(str(saved), "queen")
    body = generator.random_body(3)
    network.save(saved / "policy.npz", made(body))
    assert policies.policy(str(saved), body).joints == len(body.joint_names)
    assert_refused(saved, f"^policy .*: made for {body.name}, and not for tick$")


def test_a_body_of_another_name_or_look_is_the_same_body(saved):
    body = generator.random_body(3)
    network.save(saved / "policy.npz", made(body))
    for changes in ({"name": "pup"}, {"palette": "coral"}, {"ornaments": False}, {"name": "tick", "palette": 3}):
        assert policies.policy(str(saved), body.replace(**changes)).joints == len(body.joint_names)
    denser = body.replace(density=1.01 * body.density)
    with pytest.raises(ValueError, match=f"^policy .*: made for another body of that name, and not for {body.name}$"):
        policies.policy(str(saved), denser)


def test_a_robot_that_has_changed_since_training_is_a_warning(saved):
    tick = ROBOTS["tick"]
    policies.policy(str(saved), tick.replace(palette="coral"))  # without one
    with pytest.warns(UserWarning, match=r"^policy .*: learned with another tick than this one$"):
        policies.policy(str(saved), tick.replace(density=1.01 * tick.density))
    record = lambda array: np.array(json.dumps(json.loads(str(array)) | {"physics_sha256": 64 * "0"}))  # noqa: E731
    path = rewritten(saved, "policy", record)
    with pytest.warns(UserWarning, match=r"^policy .*: the model of tick, walk has changed since its training$"):
        policies.policy(str(path), "tick")


def test_blocks_that_its_task_excluded_are_left_out(saved):
    observed = arc_suite.load("tick", "walk", {"random": 0}).reset().observation
    blocks = {name: block[None] for name, block in observed.items()}
    whole = policies.policy(str(saved), "tick")
    rest = {name: size for name, size in whole.blocks.items() if name != "contact_forces"}
    graph = traced(lambda x: x.node("Product", np.eye(sum(rest.values()), 18)), sum(rest.values()))
    setup = Setup.of("tick", "walk", {"exclude_blocks": ["contact_forces"]})
    blind = whole._replace(graph=graph, setup=setup, blocks=rest)
    del (less := dict(blocks))["contact_forces"]
    np.testing.assert_array_equal(blind.act(blocks, np.zeros(1)), blind.act(less, np.zeros(1)))


def test_of_another_task(saved):
    policy = policies.policy(str(saved), "tick")
    with refused(
        "policy of tick, walk: observations differ from those in training: command has 6, not 0, scan has 175, "
        'not 0 numbers; exclude_blocks=["command", "scan"] leaves out what it does not read'
    ):
        evaluation.run(arc_suite.load("tick", "roam"), policy, 0)


def test_repr_has_no_weights(saved):
    assert repr(network.load(saved)) == "Network(tick, walk: 199 observations)"


def test_no_file_is_one_line(tmp_path):
    line = f"cannot read {tmp_path / 'policy.npz'}: no such file; a run writes it at its first evaluation"
    for read in (lambda: policies.policy(str(tmp_path), "tick"), lambda: policies.training_seeds(str(tmp_path))):
        with refused(line, OSError):
            read()
    with pytest.raises(ValueError, match=r"^unknown policy 'run'"):
        policies.policy("run", "tick")


def test_no_run_of_that_name_is_one_line_with_one_that_is_there(saved, monkeypatch):
    monkeypatch.chdir(saved)
    with pytest.raises(OSError, match=r"^cannot read polisy\.npz: no such file; did you mean policy\.npz\?$"):
        network.load("polisy.npz")


@pytest.mark.parametrize("kept", [0, 30, 1000, -20])
def test_damaged_files(saved, kept):
    file = saved / "policy.npz"
    file.write_bytes(file.read_bytes()[:kept])
    assert_refused(file, DAMAGED)


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"nodes": [["Sigmoid", "observations"]]}, "node 0, Sigmoid: unknown operator 'Sigmoid'"),
        ({"nodes": [["Relu", "observations"]]}, r"policy\.npz: moves 199 joints, and tick has 18$"),
        ({"nodes": [["Relu", "observations"], ["Relu", 1]]}, "node 1, Relu: unknown input 1$"),
        ({"nodes": [["Relu", "observations"], ["Relu", False]]}, "node 1, Relu: unknown input False$"),
        ({"nodes": [["Relu", "nowhere"]]}, "node 0, Relu: unknown input 'nowhere'$"),
        ({"nodes": [["Relu", ["observations"]]]}, "a damaged one: node 0, Relu: "),
        ({"nodes": [["Add", "observations"]]}, "node 0, Add: expected 2 inputs, got 1$"),
        ({"nodes": [["Concat"]]}, "node 0, Concat: expected one or more inputs, got 0$"),
        ({"nodes": [["Concat", *["observations"] * 30_000]]}, "node 0, Concat: expected at most 4194304 numbers"),
        ({"nodes": [["Neg", "0"]]}, r"node 0, Neg: expected a leading axis for environments, got \(199,\)$"),
        ({"nodes": [["Clip", "observations", "0", "0"]]}, "node 0, Clip: expected a number for each limit"),
        ({"nodes": []}, "expected 1 to 1024 nodes, got 0$"),
        ({"nodes": [["Relu", "observations"]] * 1025}, "expected 1 to 1024 nodes, got 1025$"),
        ({"nodes": 3}, "a damaged one: "),
        ({"nodes": [3]}, "a damaged one: "),
        ({"layers": ["relu"]}, r"npz: .* holds layers, as policies did before they were graphs: train it again$"),
        ({"blocks": {"posture": 3}}, "a damaged one: node 0, Sub: "),
        ({"blocks": 3}, "blocks: expected a mapping"),
        ({"blocks": [1]}, "blocks: expected a mapping"),
        ({"blocks": {"posture": 10**13}}, "a damaged one: "),
        ({"blocks": {"posture": 10**30}}, "a damaged one: "),
        ({"robot": None}, "expected robot to be a str"),
        ({"physics_sha256": 3}, "expected physics_sha256 to be a str, got 3$"),
        ({"task": "a:stroll"}, r"npz: task 'a:stroll': files import nothing; import 'a' first$"),
    ],
)
def test_files_made_in_bad_faith(saved, change, line):
    described = lambda array: np.array(json.dumps(json.loads(str(array)) | change))  # noqa: E731
    assert_refused(rewritten(saved, "policy", described), line)


@pytest.mark.parametrize(
    ("name", "change", "line"),
    [
        ("4", lambda array: array * np.nan, "array 4 is not finite"),
        ("5", lambda array: array[:1], r"node 3, Linear: weight \(199, 32\) and bias \(1,\) do not fit \(1, 199\)"),
        ("5", lambda array: array[:, None], "node 3, Linear: weight"),
        ("4", lambda array: array[:, 0], "node 3, Linear: weight"),
        ("6", lambda array: array.astype(float), "array 6: expected float32 or int32, got float64"),
        ("3", lambda array: array[None], "node 2, Clip: expected a number for each limit"),
        ("6", lambda array: array[:0], r"array 6: expected float32 or int32, got float32 \(0,\)"),
        ("policy", lambda array: np.array("[" * 100_000), "nested too deeply"),
        (
            "policy",
            lambda array: np.array({"nodes": []}, object),
            "policy.npy: expected numbers or texts",
        ),
    ],
)
def test_arrays_made_in_bad_faith(saved, name, change, line):
    assert_refused(rewritten(saved, name, change), DAMAGED + line)


def test_archives_made_in_bad_faith(saved):
    """A large file that is packed small, another compression, and a pipe, which nobody writes to."""
    file = saved / "policy.npz"
    np.savez_compressed(file, policy=np.zeros(1 << 26))
    assert file.stat().st_size < 1 << 20
    assert_refused(file, r"policy\.npz: .* expected at most 268435456 bytes, got 536\d+$")
    with zipfile.ZipFile(file, "w", zipfile.ZIP_LZMA) as archive:
        archive.writestr("policy.npy", b"")
    assert_refused(file, r"policy\.npz: .* policy\.npy: expected no compression, or deflate$")
    file.unlink()
    os.mkfifo(file)
    assert_refused(file, r"policy\.npz: .* expected a file$")


def test_a_policy_of_torques_is_refused_where_positions_are_taken(saved):
    task = arc_suite.load("tick", "walk", {"actions": "position"}).task.definition
    with pytest.raises(ValueError, match="its actions are a torque a joint, and walk takes a position$"):
        policies.policy(str(saved), "tick", task=task)
    assert policies.policy(str(saved), "tick", task=arc_suite.load("tick", "walk").task.definition) is not None
    network.save(saved / "policy.npz", made()._replace(setup=Setup.of("tick", "walk", {"actions": "position"})))
    assert policies.policy(str(saved), "tick", task=task) is not None


@pytest.mark.parametrize(
    ("robot", "settings", "line"),
    [
        ("queen", {}, "made for tick, and not for queen"),
        ("tick", {"actions": "position"}, "its actions are a torque a joint, and walk takes a position"),
    ],
)
def test_a_network_is_refused_where_its_file_is(saved, robot, settings, line):
    kwargs = {"task_kwargs": settings | {"time_limit": 0.5}, "episodes": 1}
    with refused(f"policy {saved}: {line}"):
        evaluation.evaluate(str(saved), robot, **kwargs)
    for policy in (made(), policies.load_network(str(saved))):
        with refused(f"policy: {line}"):
            evaluation.evaluate(policy, robot, **kwargs)


def test_a_network_of_one_body_and_of_many_acts_as_its_file(saved):
    settings = {"time_limit": 0.5}
    for policy in (made(), of_many_bodies()):
        network.save(saved / "policy.npz", policy)
        of_file = evaluation.evaluate(str(saved), "tick", task_kwargs=settings, episodes=1)
        of_object = evaluation.evaluate(policy, "tick", task_kwargs=settings, episodes=1)
        assert of_object.returns.mean == of_file.returns.mean
