"""The pages for users of Gymnasium and dm_control: their code runs, and what they say of limits and rewards holds."""

import page_commands
import programs
import pytest

import arc_suite
from arc_suite import suite

GYMNASIUM = page_commands.page("coming_from_gymnasium")
DM_CONTROL = page_commands.page("coming_from_dm_control")
(TRAINING_SECTION,) = list(page_commands.sections(GYMNASIUM).values())[1:]


def run_python(text, index=0):
    """Run a block of Python of a page."""
    block = [block for block in page_commands.blocks(text) if block.kind == "python"][index]
    variables = {}
    exec(compile(block.text, "page.md", "exec"), variables)
    return variables


@pytest.mark.slow
def test_an_episode_of_gymnasium_is_filmed(tmp_path, monkeypatch):
    pytest.importorskip("moviepy", reason="of the extra `video`")
    monkeypatch.chdir(tmp_path)
    variables = run_python(GYMNASIUM)
    assert (tmp_path / "videos" / "rl-video-episode-0.mp4").stat().st_size > 1000
    assert {"reward_forward", "progress_speed"} <= variables["info"].keys()


@pytest.mark.long
def test_stable_baselines3_learns_with_tensorboard(tmp_path, monkeypatch):
    pytest.importorskip("stable_baselines3", reason="of the extra `sb3`: make check-sb3")
    monkeypatch.chdir(tmp_path)
    run_python(TRAINING_SECTION)
    assert list(tmp_path.glob("runs/sb3/*/events.out.tfevents.*"))
    done = programs.arc_suite("evaluate", "--policy=runs/sb3/tick.zip", "--episodes=1", cwd=tmp_path)
    assert "\ntick " in programs.passed(done)


@pytest.mark.slow
def test_an_episode_of_dm_control(capsys):
    variables = run_python(DM_CONTROL)
    assert variables["pixels"].shape == (240, 320, 3)
    assert "posture" in capsys.readouterr().out


@pytest.mark.slow
def test_a_body_stands_on_the_ground_of_a_composer_task():
    variables = run_python(DM_CONTROL, 1)
    assert 0.7 < variables["timestep"].reward < 0.85
    assert variables["environment"].physics.data.ncon >= 6


def test_settings_of_environments_that_dm_control_has():
    flat = suite.load("tick", "walk", task_kwargs={"random": 7}, environment_kwargs={"flat_observation": True})
    assert flat.reset().observation["observations"].shape == (199,)
    for name, value in {"time_limit": 5, "control_timestep": 0.02, "n_sub_steps": 2, "action_repeat": 2}.items():
        with pytest.raises(ValueError, match=f"environment setting '{name}': "):
            suite.load("tick", "walk", environment_kwargs={name: value})
    assert suite.BENCHMARKING == arc_suite.BENCHMARKING and ("queen", "walk") in suite.ALL_TASKS


def test_discounts_at_the_ends_of_episodes():
    limited = suite.load("tick", "walk", task_kwargs={"random": 7, "time_limit": 0.1})
    limited.reset()
    discounts = [limited.step([0.0] * 18).discount for _ in range(2)]
    assert discounts == [1.0, 1.0]
    falling = suite.load("queen", "walk", task_kwargs={"random": 7, "healthy_range": (0.74, 0.8)})
    falling.reset()
    assert falling.step([1.0] * 18).discount == 0.0
