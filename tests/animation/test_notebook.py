"""`arc_suite.animation.show`: a walk inline in a notebook, as one element with nothing to fetch."""

import base64
import html.parser
import io
import re

import gymnasium
import numpy as np
import pytest
from page_data import data_of
from PIL import Image
from refusals import refused

import arc_suite
from arc_suite import animation
from arc_suite.animation import pages
from arc_suite.cpg import Demonstrator
from arc_suite.policies import POLICIES, policy
from arc_suite.simulation.opengl import RenderingUnavailable
from arc_suite.style import record

SETTINGS = {"random": 5, "time_limit": 0.5, "gait": "wave"}


@pytest.fixture
def bundle(monkeypatch):
    """Something in place of the viewer, with what a page must hide from the notebook around it."""
    monkeypatch.setattr(pages, "viewer_script", lambda: 'window.viewer = "</iframe>" && 1;')


def element(shown):
    """Return the attributes of the only element that a notebook gets."""
    found = []

    class Parser(html.parser.HTMLParser):
        def handle_starttag(self, tag, attributes):
            found.append((tag, dict(attributes)))

    Parser().feed(shown._repr_html_())
    ((tag, attributes),) = found
    return tag, attributes


def walk_of(shown):
    tag, attributes = element(shown)
    assert tag == "iframe"
    (walk,) = data_of(attributes["srcdoc"])
    return walk


def test_the_page_is_whole_and_holds_the_walk(bundle):
    environment = arc_suite.load("tick", "walk", SETTINGS)
    environment.reset()
    before = environment.physics.get_state().copy()
    shown = animation.show(environment, seed=3)
    assert (environment.physics.get_state() == before).all()  # its own episode goes on
    track = record(arc_suite.load("tick", "walk", SETTINGS), policy("cpg", "tick", "refined"), 3)
    _, attributes = element(shown)
    assert attributes["srcdoc"] == pages.page({"tick, cpg": track})
    assert not re.search(r'(src|href)\s*=\s*"(?!data:)|https?://|@import|url\(', attributes["srcdoc"])


def test_environments_and_policies_of_every_kind(bundle):
    settings = {"task_kwargs": SETTINGS}
    dm = arc_suite.load("tick", "walk", SETTINGS)
    one = gymnasium.make("arc_suite/tick-walk-v0", **settings)
    many = gymnasium.make_vec("arc_suite/tick-walk-v0", num_envs=2, **settings)
    shown = [
        walk_of(animation.show(environment, Demonstrator("tick", "medium"), steps=4)) for environment in (dm, one, many)
    ]
    assert shown[0] == shown[1] == shown[2] and len(shown[0]["positions"]) == 4
    still = walk_of(animation.show(dm, "zero", steps=4))
    assert still | {"label": "tick, policy"} == walk_of(animation.show(dm, lambda timestep: np.zeros(18), steps=4))
    one.close(), many.close()


def test_errors_are_one_line(bundle):
    environment, cart = arc_suite.load("tick", "walk"), gymnasium.make("CartPole-v1")
    for arguments, line in (
        ((cart,), "environment: expected one of arc_suite.load, gymnasium.make or gymnasium.make_vec, got TimeLimit"),
        ((environment, 7), "policy: expected a name, a policy or a function of a TimeStep, got int"),
        ((environment, "cgp"), f"unknown policy 'cgp'; did you mean 'cpg'? (there are: {', '.join(POLICIES)})"),
    ):
        with refused(line):
            animation.show(*arguments)
    with refused("steps: expected an integer from 1, got 0"):
        animation.show(environment, steps=0)


def test_a_film_needs_no_viewer():
    settings = {"time_limit": 0.5}
    try:
        shown = animation.show(arc_suite.load("tick", "walk", settings), "zero", seed=3, steps=3, film=True)
        same = animation.show(arc_suite.load("tick", "walk", settings), "zero", seed=3, steps=3, film=True)
        other = animation.show(arc_suite.load("tick", "walk", settings), "zero", seed=4, steps=3, film=True)
    except RenderingUnavailable:
        pytest.skip("no OpenGL here")
    assert shown.html == same.html != other.html
    tag, attributes = element(shown)
    kind, _, data = attributes["src"].partition(",")
    film = Image.open(io.BytesIO(base64.b64decode(data)))
    assert (tag, kind, film.format, film.size, film.n_frames) == (
        "img",
        "data:image/webp;base64",
        "WEBP",
        (240, 180),
        4,
    )
