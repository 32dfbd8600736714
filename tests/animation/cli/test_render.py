"""`arc-suite render` writes pictures and films that other programs can read, or one line and nothing."""

import os
import pathlib
import re

import imageio.v2 as imageio
import mujoco
import numpy as np
import programs
import pytest
from PIL import Image
from tiers import never, tiers

import arc_suite
from arc_suite.bodies import generator
from arc_suite.models.sizing import control_timestep
from arc_suite.policies import alone, policy
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec_files import body_to_json
from arc_suite.simulation import films

CAMERAS = "(there are: tracking, portrait, profile, eye)"
EXTENSIONS = "(there are: .png, .mp4, .gif, .webp, .html)"


def render(folder, *arguments):
    return programs.arc_suite("render", "--width=64", "--height=48", *arguments, cwd=folder)


def views_of(path, columns, rows):
    picture = np.asarray(Image.open(path))
    assert picture.shape == (48 * rows, 64 * columns, 3)
    return [view for row in np.split(picture, rows) for view in np.split(row, columns, axis=1)]


def distinct(pictures):
    return len({picture.tobytes() for picture in pictures})


@pytest.mark.slow
def test_png_of_the_demonstrator_is_a_gait_cycle(tmp_path):
    out = programs.passed(render(tmp_path, "--robot=queen", "--policy=cpg", "--output=queen.png"))
    # 60 steps are 4.5 cycles of 1.5 Hz; the next starts with step 67, its last view is 5/6 of a cycle later.
    assert re.fullmatch(r"queen: return 2[0-9]{2}\.[0-9] in 78 steps\nwrote queen.png\n", out)
    assert distinct(views_of(tmp_path / "queen.png", 3, 2)) == 6
    assert os.listdir(tmp_path) == ["queen.png"]


@pytest.mark.slow
def test_png_of_any_other_policy_is_one_view(tmp_path):
    done = render(tmp_path, "--robot=tick", "--policy=zero", "--steps=0", "--output=tick.PNG")
    assert programs.passed(done) == "tick: return 0.0 in 0 steps\nwrote tick.PNG\n"
    (view,) = views_of(tmp_path / "tick.PNG", 1, 1)
    assert view.std() > 10.0


@pytest.mark.slow
def test_png_of_all_robots_is_a_panel(tmp_path):
    out = programs.passed(render(tmp_path, "--robot=all", "--steps=3", "--output=robots.png"))
    assert re.findall(r"(\w+): return", out) == list(ROBOTS)
    assert distinct(views_of(tmp_path / "robots.png", 2, -(-len(ROBOTS) // 2))) >= len(ROBOTS)


@pytest.mark.slow
def test_gif_shows_every_control_step_in_real_time(tmp_path):
    programs.passed(render(tmp_path, "--robot=bastion", "--steps=6", "--preset=fast", "--output=bastion.gif"))
    with Image.open(tmp_path / "bastion.gif") as film:
        assert (film.n_frames, film.size, film.info["duration"], film.info["loop"]) == (6, (64, 48), 50, 0)
        frames = []
        for i in range(6):
            film.seek(i)
            frames.append(np.asarray(film.convert("RGB")))
    assert distinct(frames) == 6


@pytest.mark.long
def test_mp4_ends_with_the_episode_and_plays_anywhere(tmp_path):
    """Under the random policy Leaper falls long before 200 steps; odd sizes become even, as yuv420p needs."""
    odd = ("--robot=leaper", "--policy=random", "--width=65", "--height=49", "--steps=200")
    done = render(tmp_path, *odd, "--output=leaper.mp4")
    assert done.returncode == 0, done.stderr
    steps = int(re.search(r"in ([0-9]+) steps", done.stdout)[1])
    assert 10 < steps < 100
    with imageio.get_reader(tmp_path / "leaper.mp4") as film:
        about = film.get_meta_data()
        frames = list(film.iter_data())
    assert len(frames) == steps
    assert (about["codec"], about["pix_fmt"][:7], about["fps"], about["size"]) == ("h264", "yuv420p", 20, (66, 50))
    assert np.abs(frames[0].astype(int) - frames[-1]).mean() > 1.0


@pytest.mark.parametrize(
    ("scale", "frames", "milliseconds"),
    tiers([(1.0, 6, 350), (16.0, 6, 1390), (0.1, 3, 110)], never, lambda scale, *pace: scale == 16),
)
def test_films_keep_the_pace_of_any_body(tmp_path, scale, frames, milliseconds):
    """A giant's control step is longer, a mite's shorter than what players show: some of its frames are left out."""
    body = generator.scaled(generator.generate(4, 2), scale)
    (tmp_path / "body.json").write_text(body_to_json(body))
    programs.passed(render(tmp_path, "--spec=body.json", "--steps=6", "-o", "body.gif"))
    durations = []
    with Image.open(tmp_path / "body.gif") as film:
        for i in range(film.n_frames):
            film.seek(i)
            durations.append(film.info["duration"])
    assert (len(durations), sum(durations)) == (frames, milliseconds)
    assert milliseconds / 1000 == pytest.approx(6 * control_timestep(body), abs=0.005)


@pytest.mark.parametrize(("extension", "milliseconds"), [(".gif", 670), (".webp", 666)])
def test_a_film_keeps_the_sum_of_frames_between_the_units_of_its_format(tmp_path, extension, milliseconds):
    path = tmp_path / f"a{extension}"
    frames = np.zeros((20, 8, 20, 3), np.uint8)
    frames[range(20), 4, range(20)] = 255
    films.WRITERS[extension](path, frames, 0.0333)
    with Image.open(path) as film:
        total = 0
        for i in range(film.n_frames):
            film.seek(i)
            film.load()
            total += film.info["duration"]
    assert (film.n_frames, total, film.info["loop"]) == (20, milliseconds, 0)


def test_no_frame_of_a_gif_is_shorter_than_players_show(tmp_path):
    """A clip of 37/30 s at 50 frames a second: 62 frames of 19.9 ms, some of which were rounded to 10 ms."""
    frames = np.zeros((62, 8, 62, 3), np.uint8)
    frames[range(62), 4, range(62)] = 255
    films.write_gif(tmp_path / "a.gif", frames, 37 / 30 / 62)
    with Image.open(tmp_path / "a.gif") as film:
        durations = []
        for i in range(film.n_frames):
            film.seek(i)
            durations.append(film.info["duration"])
    assert durations == [20] * 62


@pytest.mark.long
def test_a_loop_holds_whole_cycles_at_any_frames_a_second(tmp_path):
    """Leaper's gait of 1.2 Hz: of 20 steps one cycle, 5 / 6 s, is the nearest; its last frame leads to the first."""
    programs.passed(render(tmp_path, "--robot=leaper", "--steps=20", "--fps=60", "--loop", "-o", "leaper.webp"))
    with Image.open(tmp_path / "leaper.webp") as film:
        views, total = [], 0
        for i in range(film.n_frames):
            film.seek(i)
            views.append(np.asarray(film.convert("RGB")).astype(float))
            total += film.info["duration"]
    changes = [abs(view - views[i - 1]).mean() for i, view in enumerate(views)]  # the first is over the seam
    assert (len(views), total) == (50, 833)
    assert 0.0 < changes[0] < 2.0 * max(changes[1:])


@pytest.mark.parametrize("steps_to_stop", [1, 8])
def test_a_cycle_has_its_views_though_a_command_stops_the_body_meanwhile(steps_to_stop):
    environment = arc_suite.load("tick", "steer", {"random": 0})
    demonstrator = policy("cpg", "tick", task=environment.task.definition)

    def act_under_command(timestep):
        is_stopped = footage.steps >= 20 + steps_to_stop
        environment.command("command", (0.0 if is_stopped else 1.0, 0.0, 0.0))
        return alone(demonstrator, 0)(timestep)

    footage = films.Footage("tick", environment, act_under_command, "profile", (64, 48))
    footage.view = lambda: np.zeros((48, 64, 3), np.uint8)
    for _ in range(20):
        footage.step()
    assert footage.advance
    assert len(list(films.cycle(footage, 6))) == 6
    assert not footage.advance and footage.steps < 60


def test_poses_between_control_steps_are_those_of_the_physics():
    environment = arc_suite.load("tick", "walk", {"random": 0})
    tuned = policy("cpg", "tick", "tuned", task=environment.task.definition)
    footage, physics = films.Footage("tick", environment, alone(tuned, 0), "profile", (64, 48)), environment.physics
    model, full = physics.model.ptr, mujoco.mjtState.mjSTATE_INTEGRATION
    state, data = np.empty(mujoco.mj_stateSize(model, full)), mujoco.MjData(model)
    for _ in range(30):
        mujoco.mj_getState(model, physics.data.ptr, state, full)
        footage.step()
    mujoco.mj_setState(model, data, state, full)
    data.ctrl[:] = physics.data.ctrl
    np.testing.assert_allclose(footage.interpolate(0.0), data.qpos, atol=1e-12)
    mujoco.mj_step(model, data, 10)
    np.testing.assert_allclose(footage.interpolate(10 / 25), data.qpos, atol=0.003)
    np.testing.assert_allclose(footage.interpolate(1.0), physics.data.qpos, atol=1e-12)
    footage.close()


def test_ornaments_swing_in_films_and_rest_in_single_pictures():
    environment = arc_suite.load("queen", "walk", {"random": 0})
    tuned = policy("cpg", "queen", "tuned", task=environment.task.definition)
    footage = films.Footage("queen", environment, alone(tuned, 0), "profile", (96, 72))
    for _ in range(40):
        footage.step()
    picture = environment.physics.render(72, 96, "profile", quality="film")
    film = footage.view()
    np.testing.assert_array_equal(film, footage.view())  # at the same time
    is_moved = abs(film.astype(int) - picture).max(axis=-1) > 30
    assert 5 < is_moved.sum() < 0.1 * is_moved.size
    np.testing.assert_array_equal(environment.physics.render(72, 96, "profile", quality="film"), picture)
    footage.close()


def test_the_eye_shows_what_a_policy_sees():
    environment = arc_suite.load("bastion", "steer", {"random": 0})
    footage = films.Footage("bastion", environment, alone(policy("zero", "bastion"), 0), "eye", (64, 48))
    np.testing.assert_array_equal(footage.view(), environment.physics.render(48, 64, "eye"))
    footage.close()


def test_a_take_stays_at_its_end():
    environment = arc_suite.load("leaper", "walk", {"random": 0})
    footage = films.Footage("leaper", environment, alone(policy("random", "leaper"), 0), "profile", (64, 48))
    for _ in range(200):
        if footage.ended:
            break
        footage.step()
    before = footage.steps, footage.episode_return
    footage.step()
    assert footage.ended
    assert (footage.steps, footage.episode_return) == before
    footage.close()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--camera=portait", "--output=a.png"], f"unknown camera 'portait'; did you mean 'portrait'? {CAMERAS}"),
        (["--camera=", "--output=a.png"], "--camera=: expected a value, got none"),
        (["--output=a.jpg"], f"unknown extension '.jpg'; did you mean '.png'? {EXTENSIONS}"),
        (["--steps=0", "--output=a.html"], "--steps=0: expected 1 or more for a film or a page"),
        (["--fps=60", "--output=a.gif"], "fps: expected at most 50 for a GIF, got 60"),
        (["--loop", "--output=a.png"], "--loop: it is for .mp4, .gif, .webp, not for .png"),
        (["--output=missing/a.mp4"], "cannot write missing/a.mp4: no such file or directory"),
        ([], "no file to write; say --output=FILE.png, .mp4, .gif, .webp or .html"),
    ],
)
def test_bad_input_is_one_line_and_leaves_no_file(tmp_path, arguments, message):
    programs.refused(programs.arc_suite("render", *arguments, cwd=tmp_path), f"arc-suite render: {message}\n")
    assert os.listdir(tmp_path) == []


def test_without_opengl_it_says_what_to_do_and_leaves_the_old_file(tmp_path, monkeypatch):
    (tmp_path / "queen.png").write_text("old")
    monkeypatch.setenv("MUJOCO_GL", "vulkan")
    done = render(tmp_path, "--output=queen.png")
    programs.refused(done, "arc-suite render: cannot render with MUJOCO_GL=vulkan: ")
    assert done.stderr.endswith("; unset it, or set MUJOCO_GL=egl\n")
    assert [path.read_text() for path in tmp_path.iterdir()] == ["old"]


def test_an_error_of_ffmpeg_is_one_line(tmp_path):
    picture = np.zeros((64, 64, 3), np.uint8)
    with pytest.raises(OSError, match="ffmpeg has not written all of it"):
        films.write_mp4(tmp_path / "missing" / "a.mp4", [picture] * 3, 0.02)


def test_a_film_that_is_interrupted_ends_ffmpeg(tmp_path, capfd):
    def frames():
        yield np.zeros((64, 64, 3), np.uint8)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        films.write_mp4(tmp_path / "a.mp4", frames(), 0.02)
    assert capfd.readouterr().err == ""
    commands = [path.read_bytes() for path in pathlib.Path("/proc").glob("[0-9]*/cmdline") if path.exists()]
    assert not [command for command in commands if os.fsencode(tmp_path) in command]
