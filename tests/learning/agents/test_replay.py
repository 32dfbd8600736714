"""Transitions in files: what is sampled is what was added, also after the ring has come round."""

import numpy as np
import pytest
from refusals import refused

from arc_suite.learning.agents.learner import Damaged
from arc_suite.learning.agents.replay import CombinedReplay, Replay

SIZE, JOINTS = 3, 2


def fill(replay, episodes, start=0):
    """Add episodes of lengths, the observation of whose step t is start + t everywhere; return what was added."""
    added = []
    for length, terminated in episodes:
        for step in range(length):
            last = step == length - 1
            here, following = np.full(SIZE, start), np.full(SIZE, start + 1)
            replay.add(here, np.full(JOINTS, -start), 10.0 * start, terminated and last, following, last)
            added.append((start, 0.0 if terminated and last else 1.0))
            start += 1
        start += 1  # the observation after the last action
    return added


def check(source, added):
    batch = source.transitions_at(np.arange(len(source)))
    for index, (step, goes_on) in enumerate(added[-len(source) :]):
        assert (batch.observations[index] == step).all()
        assert (batch.next_observations[index] == step + 1).all()
        assert (batch.actions[index] == -step).all()
        assert (batch.rewards[index], batch.goes_on[index]) == (10.0 * step, goes_on)


def counters_of(replay):
    return replay.total, replay.ends, replay.checksum


EPISODES = [(5, True), (1, False), (7, False), (1, True), (4, True)]


@pytest.mark.parametrize("capacity", [1, 2, 6, 17, 18, 40])
def test_what_was_added(tmp_path, capacity):
    replay = Replay(tmp_path, capacity, SIZE, JOINTS, slack=3)
    added = fill(replay, EPISODES)
    assert len(replay) == min(capacity, len(added))
    check(replay, added)


def test_many_ends(tmp_path):
    """More final observations than their file holds at first."""
    replay = Replay(tmp_path, 1000, SIZE, JOINTS)
    check(replay, fill(replay, [(2, True)] * 700))


def test_goes_on_from_where_it_was(tmp_path):
    """What was added after a checkpoint is overwritten by the same, and sampled from before it is what it was."""
    replay = Replay(tmp_path, 10, SIZE, JOINTS, slack=6)
    added = fill(replay, [(9, True)] * 3)
    counters = counters_of(replay)
    fill(replay, [(6, True)], start=1000)
    again = Replay(tmp_path, 10, SIZE, JOINTS, 6, "r+")
    again.restore(*counters)
    check(again, added)
    fill(replay, [(3, True)], start=1006)  # more than the slack
    with pytest.raises(Damaged, match=r"holds other transitions$"):
        again.restore(*counters)


@pytest.mark.parametrize("name", ["observations", "actions", "rewards", "goes_on", "ends", "final_observations"])
def test_a_file_that_is_gone_cut_or_overwritten(tmp_path, name):
    replay = Replay(tmp_path, 10, SIZE, JOINTS)
    fill(replay, EPISODES)
    counters = counters_of(replay)
    path = tmp_path / name
    content = path.read_bytes()
    missing, other = f"{path} is missing or too short", f"{tmp_path} holds other transitions"
    damages = ((bytes(len(content)), "r+", other), (content[:1], "r", missing), (content[:1], "r+", other))
    for damaged, mode, line in damages:
        path.write_bytes(damaged)
        with refused(line, Damaged):
            Replay(tmp_path, 10, SIZE, JOINTS, 0, mode).restore(*counters)
    path.unlink()
    with refused(missing, Damaged):
        Replay(tmp_path, 10, SIZE, JOINTS, 0, "r")
    assert not path.exists()


def test_a_buffer_that_never_came_round_can_grow(tmp_path):
    replay = Replay(tmp_path, 18, SIZE, JOINTS, slack=1)
    added = fill(replay, EPISODES)
    larger = Replay(tmp_path, 40, SIZE, JOINTS, 1, "r+")
    larger.restore(*counters_of(replay))
    check(larger, added + fill(larger, EPISODES, start=500))
    assert len(larger) == 36


def interleave(replay, streams, start=0):
    """Add the steps of several environments in turn; streams are (rewards, terminated) of endless episodes."""
    for step, together in enumerate(zip(*streams, strict=True), start):
        for index, (reward, terminated) in enumerate(together):
            here, following = np.full(SIZE, 100 * index + step), np.full(SIZE, 100 * index + step + 0.5)
            is_last = terminated is not None
            following = following if is_last else np.full(SIZE, 100 * index + step + 1)
            replay.add(here, np.zeros(JOINTS), reward, bool(terminated), following, is_last)


@pytest.mark.parametrize("buffer_size", [12, 40])
def test_several_steps_of_several_environments(tmp_path, buffer_size):
    """Rewards are discounted; falls, time limits and the latest transition end the sum."""
    ends = {0: {3: True}, 1: {4: False}, 2: {}}  # by environment and step: whether it is terminated there
    streams = [[(10.0**index, ends[index].get(step)) for step in range(6)] for index in range(3)]
    replay = Replay(tmp_path, buffer_size, SIZE, JOINTS, slack=2, num_envs=3)
    interleave(replay, streams)
    assert len(replay) == min(buffer_size, 18)
    batch = replay.transitions_at(np.arange(len(replay)), n_step=3, discount=0.5)
    for place, (step, index) in enumerate([(step, index) for step in range(6) for index in range(3)][-len(replay) :]):
        last = next((each for each in range(step, step + 3) if each in ends[index] or each == 5), step + 2)
        terminated = ends[index].get(last)
        assert (batch.observations[place] == 100 * index + step).all()
        assert (batch.next_observations[place] == 100 * index + last + (1 if terminated is None else 0.5)).all()
        assert batch.rewards[place] == 10.0**index * sum(0.5**power for power in range(last - step + 1))
        assert batch.goes_on[place] == (0.0 if terminated else 0.5 ** (last - step))


def test_several_environments_resume(tmp_path):
    replay = Replay(tmp_path, 10, SIZE, JOINTS, slack=6, num_envs=3)
    interleave(replay, [[(1.0, True if step == 4 else None) for step in range(6)]] * 3)
    counters, before = counters_of(replay), replay.transitions_at(np.arange(10), 2, 0.9)
    interleave(replay, [[(2.0, True), (2.0, None)]] * 3, start=6)
    again = Replay(tmp_path, 10, SIZE, JOINTS, 6, "r+", num_envs=3)
    again.restore(*counters)
    for one, other in zip(again.transitions_at(np.arange(10), 2, 0.9), before, strict=True):
        assert np.array_equal(one, other)


def test_files_are_read_alone(tmp_path):
    replay = Replay(tmp_path, 20, SIZE, JOINTS)
    added = fill(replay, EPISODES)
    prior = Replay(tmp_path, len(added), SIZE, JOINTS, mode="r")
    prior.restore(*counters_of(replay))
    check(prior, added)
    with pytest.raises(ValueError, match="read-only"):
        fill(prior, EPISODES)


def test_a_fence(tmp_path):
    """Two sources as one: the first keeps all it has, however often the second comes round."""
    prior, online = (Replay(tmp_path / name, 4, SIZE, JOINTS) for name in ("prior", "online"))
    first, second = fill(prior, [(4, True)]), fill(online, [(30, False)], start=100)
    both = CombinedReplay(prior, online)
    assert len(both) == 8
    indices = np.array([7, 0, 5, 3, 0, 4, 6])
    steps = [step for step, _ in (*first[-4:], *second[-4:])]
    expected = [10.0 * each for each in (steps[2] + steps[3], steps[7], steps[4] + steps[5])]
    assert both.transitions_at(np.array([2, 7, 4]), n_step=2).rewards.tolist() == expected
    batch = both.transitions_at(indices)
    assert batch.observations[:, 0].tolist() == [steps[index] for index in indices]
    assert batch.next_observations[:, 0].tolist() == [steps[index] + 1 for index in indices]


def test_a_million_transitions_of_queen_take_less_than_a_gigabyte(tmp_path):
    Replay(tmp_path, 1000, 199, 18)
    assert sum(path.stat().st_size for path in tmp_path.iterdir()) < 1000 * 930 + 256 * 199 * 4


def test_a_full_disk_is_one_line(tmp_path, monkeypatch):
    def full(*arguments):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.posix_fallocate", full)
    with pytest.raises(OSError, match=rf"^cannot write {tmp_path}/observations: no space left on device$"):
        Replay(tmp_path, 10, SIZE, JOINTS)
