"""Policies in files: what a network computes, alone and among others, and files that are none."""

import json
import os
import zipfile

import numpy as np
import pytest
from networks import drawn, made

import arc_suite
from arc_suite import evaluation, policies
from arc_suite.envs.setup import Setup
from arc_suite.envs.vector import VectorEnv
from arc_suite.policies import network
from arc_suite.policies.network import Layer
from arc_suite.robots import generator


@pytest.fixture
def saved(tmp_path):
    network.save(tmp_path / "policy.npz", made())
    return tmp_path


def test_what_layers_compute():
    numbers = drawn(1)
    x = numbers(7, 5)
    weight, bias, scale, offset = numbers(5, 4), numbers(4), numbers(4), numbers(4)
    mean, factor, limit = numbers(5), numbers(5), np.float32(0.7)
    x64 = x.astype(float)
    linear = x64 @ weight + bias
    centred = linear - linear.mean(axis=1, keepdims=True)
    normal = centred / np.sqrt(linear.var(axis=1, keepdims=True) + 1e-5) * scale + offset
    cases = [
        ([Layer("linear", (weight, bias))], linear),
        ([Layer("linear", (weight, bias)), Layer("layer_norm", (scale, offset))], normal),
        ([Layer("normalise", (mean, factor, limit))], ((x64 - mean) * factor).clip(-limit, limit)),
        ([Layer("relu")], np.where(x > 0.0, x64, 0.0)),
        ([Layer("elu")], np.where(x > 0.0, x64, np.exp(x64) - 1.0)),
        ([Layer("tanh")], np.tanh(x64)),
        ([Layer("clip")], x64.clip(-1.0, 1.0)),
    ]
    for layers, expected in cases:
        found = network.forward(layers, x)
        assert found.dtype == np.float32
        np.testing.assert_allclose(found, expected, atol=2e-6)


@pytest.mark.parametrize("num_envs", [1, 2, 10, 64, 65])
def test_an_environment_does_the_same_alone(num_envs):
    policy = made(hidden=256)
    observations = drawn(1)(num_envs, policy.size)
    alone = np.concatenate([policy.actions(observations[index : index + 1]) for index in range(num_envs)])
    assert np.array_equal(policy.actions(observations), alone)


def test_comes_back_from_a_file_to_the_bit(saved):
    policy, again = made(), network.load(saved / "policy.npz")
    assert again[1:] == policy[1:]
    for one, other in zip(policy.layers, again.layers, strict=True):
        assert one.kind == other.kind
        assert [np.asarray(array).tobytes() for array in one.arrays] == [array.tobytes() for array in other.arrays]
    assert again.joints == 18 and again.size == 199


@pytest.mark.parametrize("name", ["", "policy.npz"])
def test_is_a_policy_of_every_program(saved, name, monkeypatch):
    """By the folder of a run, or the file; in a batch and alone it does the same."""
    policy = policies.policy(str(saved / name), "tick")
    envs = VectorEnv("tick", "walk", 3, 1, "Disabled")
    assert evaluation.episodes_in_batch(envs, policy, range(3)) == evaluation.episodes(
        arc_suite.load("tick", "walk"), policy, range(3)
    )
    monkeypatch.chdir(saved.parent)
    assert policies.policy(saved.name, "tick").setup.robot == "tick"


def test_of_another_body(saved):
    with pytest.raises(ValueError, match=r"^policy .*: made for tick, and not for queen$"):
        policies.policy(str(saved), "queen")
    body = generator.random_body(3)
    network.save(saved / "policy.npz", made(body))
    assert policies.policy(str(saved), body).joints == len(body.joint_names)
    with pytest.raises(ValueError, match=f"^policy .*: made for {body.name}, and not for tick$"):
        policies.policy(str(saved), "tick")


def test_blocks_that_its_task_excluded_are_left_out(saved):
    observed = arc_suite.load("tick", "walk", {"random": 0}).reset().observation
    blocks = {name: block[None] for name, block in observed.items()}
    whole = policies.policy(str(saved), "tick")
    rest = {name: size for name, size in whole.blocks.items() if name != "contact_forces"}
    blind = whole._replace(
        layers=(Layer("linear", (np.eye(sum(rest.values()), 18, dtype=np.float32), np.zeros(18, np.float32))),),
        setup=Setup.of("tick", "walk", {"exclude_blocks": ["contact_forces"]}),
        blocks=rest,
    )
    del (less := dict(blocks))["contact_forces"]
    np.testing.assert_array_equal(blind.act(blocks, np.zeros(1)), blind.act(less, np.zeros(1)))


def test_of_another_task(saved):
    policy = policies.policy(str(saved), "tick")
    with pytest.raises(ValueError, match=r"^policy of walk: expected observation blocks \{.*\}, got \{.*command"):
        evaluation.run(arc_suite.load("tick", "steer"), policy, 0)


def test_no_file_is_one_line(tmp_path):
    with pytest.raises(OSError, match=r"^cannot read .*policy\.npz: no such file$"):
        policies.policy(str(tmp_path), "tick")
    with pytest.raises(ValueError, match=r"^unknown policy 'run'"):
        policies.policy("run", "tick")


@pytest.mark.parametrize("kept", [0, 30, 1000, -20])
def test_damaged_files(saved, kept):
    file = saved / "policy.npz"
    file.write_bytes(file.read_bytes()[:kept])
    with pytest.raises(ValueError, match=r"policy\.npz: no policy, or a damaged one: ") as caught:
        policies.policy(str(file), "tick")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"layers": ["normalise", "sigmoid"]}, "unknown layer 'sigmoid'"),
        ({"layers": ["relu"]}, r"policy\.npz: moves 199 joints, and tick has 18$"),
        ({"layers": [*["relu"] * 9, "linear"]}, "a damaged one: '9.0'"),
        ({"blocks": {"posture": 3}}, r"layer 0, normalise: array 0 does not fit 3 inputs, got float32 \(199,\)"),
        ({"blocks": 3}, "blocks: expected a mapping"),
        ({"robot": None}, "expected robot to be a str"),
        (
            {"task": "strolling:stroll"},
            r"npz: task 'strolling:stroll': files import nothing; import 'strolling' first$",
        ),
    ],
)
def test_files_made_in_bad_faith(saved, change, line):
    file = saved / "policy.npz"
    with np.load(file) as stored:
        arrays = {name: stored[name] for name in stored.files}
    known = json.loads(str(arrays.pop("policy"))) | change
    np.savez(file, policy=np.array(json.dumps(known)), **arrays)
    with pytest.raises(ValueError, match=line):
        policies.policy(str(file), "tick")


@pytest.mark.parametrize(
    ("name", "change", "line"),
    [
        ("1.0", lambda array: array * np.nan, "layer 1, linear: array 0 is not finite"),
        ("1.1", lambda array: array[:1], r"layer 1, linear: array 1 does not fit 199 inputs, got float32 \(1,\)"),
        ("1.1", lambda array: array[:, None], "layer 1, linear: array 1 does not fit"),
        ("1.0", lambda array: array[:, 0], "layer 1, linear: array 0 does not fit"),
        ("2.0", lambda array: array.astype(float), "layer 2, layer_norm: array 0 does not fit"),
        ("0.2", lambda array: array[None], "layer 0, normalise: array 2 does not fit"),
        ("policy", lambda array: np.array("[" * 100_000), "maximum recursion depth"),
    ],
)
def test_arrays_made_in_bad_faith(saved, name, change, line):
    file = saved / "policy.npz"
    with np.load(file) as stored:
        arrays = {key: stored[key] for key in stored.files}
    np.savez(file, **arrays | {name: change(arrays[name])})
    with pytest.raises(ValueError, match=rf"policy\.npz: no policy, or a damaged one: {line}"):
        policies.policy(str(file), "tick")


def test_archives_made_in_bad_faith(saved):
    """A large file that is packed small, another compression, and a pipe, which nobody writes to."""
    file = saved / "policy.npz"
    np.savez_compressed(file, policy=np.zeros(1 << 26))
    assert file.stat().st_size < 1 << 20
    with pytest.raises(ValueError, match=r"policy\.npz: .* expected at most 268435456 bytes, got 536\d+$"):
        policies.policy(str(file), "tick")
    with zipfile.ZipFile(file, "w", zipfile.ZIP_LZMA) as archive:
        archive.writestr("policy.npy", b"")
    with pytest.raises(ValueError, match=r"policy\.npz: .* policy\.npy: expected no compression, or deflate$"):
        policies.policy(str(file), "tick")
    file.unlink()
    os.mkfifo(file)
    with pytest.raises(ValueError, match=r"policy\.npz: .* expected a file$"):
        policies.policy(str(file), "tick")


def test_a_pickle_is_refused(saved):
    np.savez(saved / "policy.npz", policy=np.array({"layers": []}, object))
    with pytest.raises(ValueError, match="Object arrays cannot be loaded"):
        policies.policy(str(saved), "tick")


def test_a_policy_of_torques_is_refused_where_positions_are_taken(saved):
    task = arc_suite.load("tick", "walk", {"actions": "position"}).task.definition
    with pytest.raises(ValueError, match="its actions are a torque a joint, and walk takes a position$"):
        policies.policy(str(saved), "tick", task=task)
    assert policies.policy(str(saved), "tick", task=arc_suite.load("tick", "walk").task.definition) is not None
    network.save(saved / "policy.npz", made()._replace(setup=Setup.of("tick", "walk", {"actions": "position"})))
    assert policies.policy(str(saved), "tick", task=task) is not None
