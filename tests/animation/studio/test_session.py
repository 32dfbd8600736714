"""The loop: a creature in real time, another one after it, commands; no viser."""

import contextlib
import threading
import time

import numpy as np
import pytest

from arc_suite import style
from arc_suite.animation import player_controls
from arc_suite.animation.episodes import Episodes
from arc_suite.animation.studio import session as sessions
from arc_suite.animation.studio import texts
from arc_suite.animation.studio.creature import load_environment, load_policy, open_creature
from arc_suite.animation.studio.history import History
from arc_suite.animation.studio.session import Session
from arc_suite.animation.studio.sketch import Sketch


class Shown:
    """The states that a session shows; it takes no longer than a test waits."""

    def __init__(self, session):
        self.session, self.states = session, []

    def __call__(self, session):
        episodes, share = session.episodes, session.walker.share
        self.states.append((session.creature.setup.body.name, episodes.steps, share, episodes.qpos(share)))

    def until(self, condition, seconds=60.0):
        end = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < end, "the session did not come so far"
            time.sleep(0.01)

    def pause(self):
        """Have time stand still: the step under way when it is asked for is over."""
        self.session.pause(True)
        count = len(self.states)
        self.until(lambda: len(self.states) > count + 1)

    def steps(self, count):
        """Wait for so many control steps of the creature that walks."""
        target = self.session.episodes.steps + count
        self.until(lambda: self.session.episodes.steps >= target)


@contextlib.contextmanager
def running(sketch=Sketch(legs=6, links=2)):  # noqa: B008
    session = Session(sketch)
    shown = Shown(session)
    thread = threading.Thread(target=session.run, args=(shown,))
    thread.start()
    try:
        yield session, shown
    finally:
        session.close()
        thread.join()


@pytest.mark.long
def test_it_walks_as_the_command_says():
    with running() as (session, shown):
        shown.steps(60)
        speed, asked = session.history.speeds()[-1], session.history.desired_speeds()[-1]
        assert asked > 0.1 and speed > 0.5 * asked
        session.command((0.0, 0.0, 0.0))
        shown.steps(60)
        assert session.history.speeds()[-1] < 0.1 * asked and session.history.desired_speeds()[-1] == 0.0
        assert session.history.contacts()[1][-1].all()  # at a stop all feet are scheduled on the ground
        session.command(None)
        shown.until(lambda: session.episodes.desired is None)


def test_another_creature_walks_under_the_same_command():
    with running() as (session, shown):
        session.command((0.5, 0.0, 0.5))
        session.ask(Sketch(legs=4, links=3))
        shown.until(lambda: session.creature.sketch.legs == 4)
        shown.steps(2)
        np.testing.assert_array_equal(session.episodes.timestep.observation["command"][:3], (0.5, 0.0, 0.5))
        shown.until(lambda: shown.states[-1][0] == "walker_4x3" and len(shown.states[-1][3]) == 7 + 12)


def test_pose_and_gait_hold_for_later_creatures_as_far_as_they_can():
    with running() as (session, shown):
        session.command((0.0, 0.0, 0.0))
        session.direct((-9.0, 0.0, 0.0, 0.0, 0.0, 0.0), "ripple", 1.3)
        observed = lambda name: session.episodes.timestep.observation[name]  # noqa: E731
        shown.until(lambda: observed("gait")[-2] == pytest.approx(0.75))
        low = player_controls.pose_room(session.creature.setup.body)[0, 0]
        shown.until(lambda: observed("pose")[0] == pytest.approx(low))
        assert session.commands["pose"] == pytest.approx([low, 0.0, 0.0, 0.0, 0.0, 0.0])
        session.ask(Sketch(legs=4, links=3))  # whose legs do not ripple
        shown.until(lambda: session.creature.sketch.legs == 4)
        own = session.episodes.environment.task.definition.parameters
        assert session.commands["gait"][-2:] == [own.duty_factor, 1.3 * own.gait_frequency]
        session.ask(Sketch(legs=4, links=3, task="steer"))
        shown.until(lambda: session.creature.sketch.task == "steer")
        assert list(session.commands) == ["command"]


def test_a_kept_creature_walks_next_to_later_ones():
    with running() as (session, shown):
        session.keep(True)
        shown.until(lambda: session.companion)
        session.ask(Sketch(legs=4, links=3))
        shown.until(lambda: session.creature.sketch.legs == 4)
        session.command((0.5, 0.0, 0.0))
        shown.until(lambda: session.companion.episodes.steps > 5)
        for walker in (session.walker, session.companion):
            shown.until(lambda walker=walker: walker.episodes.timestep.observation["command"][0] == 0.5)
        assert session.companion.creature.setup.body.name == "walker_6x2"
        assert "walker_6x2, directed" in texts.status(session) and "walker_4x3, directed" in texts.status(session)
        session.keep(False)
        shown.until(lambda: session.companion is None)


@pytest.mark.slow
def test_of_several_sketches_the_last_is_made():
    with running() as (session, shown):
        for legs in (4, 5, 7, 8, 10):
            session.ask(Sketch(legs=legs, links=2))
        shown.until(lambda: session.creature.sketch.legs == 10)
        shown.steps(2)
        assert session.creature.sketch.legs == 10


def test_a_bad_combination_is_told_and_the_creature_walks_on():
    with running() as (session, shown):
        before = session.creature
        session.ask(Sketch(legs=5, layout="pairs"))
        shown.until(lambda: session.error)
        assert session.error == "layout: expected radial for an odd number of legs, got 'pairs' for 5"
        shown.steps(3)
        assert session.creature is before
        session.ask(Sketch(legs=5, links=2))
        shown.until(lambda: session.creature is not before)
        assert session.error == ""


def test_texts_of_the_page():
    """Whatever an error quotes is text, and no markup."""
    with running() as (session, shown):
        shown.steps(2)
        session.ask(Sketch(settings='{"<img src=x>": 1}'))
        shown.until(lambda: session.error)
        told = texts.status(session)
        assert 'role="alert"' in told and "&lt;img src=x&gt;" in told and "<img" not in told
        assert "walker_6x2, directed" in told and "real time" in told
        assert "walker_6x2 stands and can take steps" in texts.flaws(session.creature)
        assert "arc-suite view --legs 6 --links 2 --task directed" in texts.lines_to_copy(session.creature.sketch)


def test_a_mistake_of_ours_is_told_too(monkeypatch, capsys):
    def opened(sketch):
        raise RuntimeError("no such\nluck")

    with running() as (session, shown):
        monkeypatch.setattr(sessions, "open_creature", opened)
        session.ask(Sketch(legs=4))
        shown.until(lambda: session.error)
        assert session.error == "RuntimeError: no such luck"
        shown.steps(2)
    assert "Traceback" in capsys.readouterr().err


def test_time_can_stand_still_and_episodes_start_anew():
    with running() as (session, shown):
        shown.steps(10)
        shown.pause()
        steps, count = session.episodes.steps, len(shown.states)
        shown.until(lambda: len(shown.states) > count + 5)
        assert session.episodes.steps == steps
        session.restart()
        shown.until(lambda: session.episodes.steps == 0)
        session.pause(False)
        shown.steps(3)


def test_a_kick_throws_the_torso():
    with running(Sketch(legs=6, links=2, policy="zero")) as (session, shown):
        shown.steps(20)
        shown.pause()
        session.kick(0.0)
        velocity = session.episodes.environment.physics.data.qvel
        speed = np.sqrt(9.81 * session.creature.setup.body.torso.standing_height)
        shown.until(lambda: velocity[0] > 0.8 * speed)


def test_history_and_states_of_a_walk():
    with running() as (session, shown):
        shown.steps(40)
        shown.pause()
        history = session.history
        assert len(history) == session.episodes.steps == len(history.times)
        total = sum(terms.sum() for terms in history.terms().values())
        assert total == pytest.approx(session.episodes.episode_return)
        stance, schedule = history.contacts()
        assert stance.shape == schedule.shape == (len(history), 6) and 0.0 < stance.mean() < 1.0
    shares = {share for *_, share, _ in shown.states}  # between control steps
    assert shares - {0.0} and 0.0 <= min(shares) <= max(shares) < 1.0


@pytest.mark.parametrize("task", ["walk", "directed"])
def test_rewards_and_contacts_are_those_of_reports(task):
    sketch = Sketch(legs=6, links=2, task=task)
    creature = open_creature(sketch)
    episodes = Episodes(creature.environment, creature.act)
    history = History(episodes)
    for _ in range(100):
        episodes.step()
        history.observe()
    environment = load_environment(creature.setup)
    track = style.record(environment, load_policy(sketch, environment), 0, 100)
    np.testing.assert_allclose(episodes.environment.physics.data.qpos[:3], track.positions[-1])
    np.testing.assert_allclose(sum(history.terms().values()), track.rewards)
    np.testing.assert_array_equal(history.contacts()[0], track.stance)
    np.testing.assert_array_equal(history.contacts()[1], track.schedule)
