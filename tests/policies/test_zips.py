"""What a zip of stable-baselines3 tells without its pickles: its setup, and which statistics belong to it."""

import importlib.util
import json
import sys
import types
import zipfile
from pathlib import Path

import pytest
from refusals import refused

import arc_suite
from arc_suite import policies
from arc_suite.envs.setup import Setup
from arc_suite.policies import other_libraries, zips
from arc_suite.policies.other_libraries import find, with_further_file

ON_POLICY = {"rollout_buffer_class": {}, "_last_obs": {}}


def write(path, **data):
    """Write a zip as stable-baselines3 lays it out, without networks."""
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("data", json.dumps(data))
    return path


def test_names():
    assert find("a/ppo.zip") == (Path("a/ppo.zip"), None, ".zip")
    assert find(with_further_file("ppo.zip", "b/stats.pkl")) == (Path("ppo.zip"), Path("b/stats.pkl"), ".zip")
    assert find("a/PPO.ZIP+b/stats.pkl") == (Path("a/PPO.ZIP"), Path("b/stats.pkl"), ".zip")
    assert find("PPO.Zip") == (Path("PPO.Zip"), None, ".zip")
    assert find("a.zip+b.zip+c") == (Path("a.zip"), Path("b.zip+c"), ".zip")
    assert find("cpg") is find("policy.npz") is find("my.zip:make") is find("ppo.zip+") is None


def test_a_library_is_read_by_the_module_of_its_extension(tmp_path, monkeypatch):
    """Without a word of it elsewhere: setup, hash, checks and policy come from that module."""
    setup, loaded = Setup.of("tick"), types.SimpleNamespace(joints=18)
    reader = types.ModuleType("reader_of_text")
    reader.NO_SETUP = "says nothing of its robot"
    reader.setup = lambda path: setup if path.read_text() == "tick" else None
    reader.digest = lambda path, further: path.read_text()
    reader.load = lambda path, further: loaded
    monkeypatch.setitem(sys.modules, reader.__name__, reader)
    monkeypatch.setitem(other_libraries.READERS, ".text", reader.__name__)
    path = tmp_path / "agent.text"
    path.write_text("tick")
    assert policies.is_file(str(path)) and policies.setup_of(str(path)) == setup
    assert policies.policy(path, "tick") is loaded
    assert policies.digest(str(path)) == "tick"
    assert policies.training_seeds(path) is None
    with refused(f"policy {path}: made for tick, and not for queen"):
        policies.policy(path, "queen")
    path.write_text("nobody")
    with pytest.warns(UserWarning, match=f"^policy {path}: says nothing of its robot$"):
        policies.policy(path, "tick")
    with refused(f"policy {path}: says nothing of its robot"):
        policies.load_network(path)


def test_the_setup(tmp_path):
    setup = Setup.of("tick", "steer", {"time_limit": 2.0})
    path = write(tmp_path / "ppo.zip", observation_space={"arc_suite": setup.to_dict()})
    assert zips.setup(path) == setup
    assert zips.setup(write(tmp_path / "plain.zip", observation_space={"low": 0})) is None
    with pytest.raises(ValueError, match=r"^policy .*ppo\.zip: made for tick, and not for queen$"):
        policies.policy(str(path), "queen")
    task = arc_suite.load("tick", "steer", {"actions": "position"}).task.definition
    with pytest.raises(ValueError, match=r"its actions are a torque a joint, and steer takes a position$"):
        policies.policy(str(path), "tick", task=task)
    write(path, observation_space={"arc_suite": setup.to_dict() | {"task": "nowhere:stroll"}})
    with pytest.raises(ValueError, match=r"^policy .*: task 'nowhere:stroll': files import nothing; import 'nowhere' "):
        zips.setup(path)


@pytest.mark.parametrize(
    "name", ["tick_300_steps_vecnormalize.pkl", "tick_vecnormalize_300_steps.pkl", "vecnormalize.pkl"]
)
def test_statistics_lie_next_to_the_zip(tmp_path, name):
    path = write(tmp_path / "tick_300_steps.zip", **ON_POLICY, _last_original_obs={})
    names = "tick_300_steps_vecnormalize.pkl or tick_vecnormalize_300_steps.pkl or vecnormalize.pkl next to it"
    missing = "was trained with VecNormalize, whose statistics are missing: expected --vecnormalize FILE, or"
    with refused(f"policy {path}: {missing} {names}"):
        zips.statistics(path)
    (tmp_path / name).touch()
    assert zips.statistics(path) == tmp_path / name
    before = policies.digest(str(path))
    (tmp_path / name).write_text("others")
    assert policies.digest(str(path)) != before


def test_the_hash_of_a_zip_is_that_of_its_members(tmp_path):
    """Times, compression and order of members do not count; names and bytes do."""
    path = write(tmp_path / "sac.zip", **ON_POLICY)
    before = policies.digest(str(path))
    content = {"pytorch_version": b"2", "data": zipfile.ZipFile(path).read("data")}

    def digest(compression, members):
        with zipfile.ZipFile(path, "w", compression) as archive:
            for name, member in members.items():
                archive.writestr(zipfile.ZipInfo(name, (2001, 1, 1, 0, 0, 0)), member, compression)
        return policies.digest(str(path))

    assert digest(zipfile.ZIP_DEFLATED, {"data": content["data"]}) == before
    both = digest(zipfile.ZIP_STORED, content)
    assert both == digest(zipfile.ZIP_DEFLATED, dict(reversed(content.items()))) != before
    assert digest(zipfile.ZIP_STORED, content | {"pytorch_version": b"3"}) != both


def test_only_a_zip_that_was_trained_with_statistics_takes_them(tmp_path):
    (tmp_path / "vecnormalize.pkl").touch()
    path = write(tmp_path / "ppo.zip", **ON_POLICY, _last_original_obs=None)
    assert zips.statistics(path) is None
    with pytest.raises(ValueError, match=r"was trained without VecNormalize: expected no statistics, got .*\.pkl$"):
        zips.statistics(path, tmp_path / "vecnormalize.pkl")
    sac = write(tmp_path / "sac.zip", _last_obs={}, _last_original_obs={})  # which it has either way
    assert zips.statistics(sac) == tmp_path / "vecnormalize.pkl"
    with pytest.raises(OSError, match=r"^cannot read .*none\.pkl: no such file$"):
        zips.statistics(sac, tmp_path / "none.pkl")
    (tmp_path / "vecnormalize.pkl").unlink()
    assert zips.statistics(sac) is None


@pytest.mark.skipif(importlib.util.find_spec("stable_baselines3") is not None, reason="stable-baselines3 is installed")
def test_without_stable_baselines3_one_line_says_what_to_install(tmp_path):
    with pytest.raises(ValueError, match=r"^policy .*\.zip: zips need stable-baselines3: pip install -e '.*\[sb3\]'"):
        policies.policy(str(write(tmp_path / "sac.zip")), "tick")


def test_what_is_no_zip_is_one_line(tmp_path):
    (tmp_path / "text.zip").write_text("text")
    with zipfile.ZipFile(tmp_path / "list.zip", "w") as archive:
        archive.writestr("data", "[1, 2]")
    for path in (tmp_path / "text.zip", tmp_path / "list.zip", tmp_path / "none.zip"):
        with pytest.raises((ValueError, OSError), match=r"no policy of stable-baselines3: |no such file$") as error:
            zips.setup(path)
        assert "\n" not in str(error.value)
