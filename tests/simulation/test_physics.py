"""One simulation: its arena, its copies, and what an interrupted step leaves."""

import concurrent.futures
import copy
import pickle

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from tiers import tiers

from arc_suite.arenas import FLAT
from arc_suite.arenas.bumps import fit_bumps
from arc_suite.robots import ROBOTS
from arc_suite.simulation.physics import Physics

BODY = ROBOTS["tick"]


COPIES = {
    "copied": Physics.copy,
    "sharing the model": lambda physics: physics.copy(share_model=True),
    "deeply": copy.deepcopy,
    "pickled": lambda physics: pickle.loads(pickle.dumps(physics)),
}


@pytest.mark.parametrize("way", tiers(COPIES, lambda way: way == "pickled"))
def test_copies_go_on_in_the_same_arena(way):
    physics = Physics.from_body(BODY, fit_bumps(BODY))
    physics.set_control(np.linspace(-1.0, 1.0, physics.model.nu))
    physics.step(100)
    twin = COPIES[way](physics)
    assert (twin.body, twin.arena) == (BODY, fit_bumps(BODY))
    assert_array_equal(twin.data.cfrc_ext, physics.data.cfrc_ext)
    twin.step(25), physics.step(25)
    for field in ("qpos", "cfrc_ext", "xpos"):
        assert_array_equal(getattr(twin.data, field), getattr(physics.data, field))
    assert_array_equal(twin.render(48, 64), physics.render(48, 64))


def test_flat_ground_is_the_default():
    physics = Physics.from_body(BODY)
    assert physics.arena == FLAT
    assert physics.model.name2id("floor", "geom") == 0
    assert physics.model.nhfield == 0
    assert Physics.from_body(BODY, fit_bumps(BODY)).model.nhfield == 1


def test_a_copy_that_shares_the_model_changes_nothing_in_it():
    physics = Physics.from_body(BODY)
    heavy = 2.0 * physics.model.body_mass
    physics.change_model({"body_mass": heavy})
    twin = physics.copy(share_model=True)
    assert twin.model.ptr is physics.model.ptr
    twin.reset()
    assert_array_equal(physics.model.body_mass, heavy)
    physics.reset()
    assert_array_equal(twin.model.body_mass, 0.5 * heavy)


def test_copies_that_share_the_model_can_be_stepped_by_threads():
    physics, alone = Physics.from_body(BODY), Physics.from_body(BODY)
    twins, flags = [physics, physics.copy(share_model=True)], physics.model.opt.disableflags

    def stepped(simulation):
        for _ in range(200):
            simulation.step(5)

    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        list(pool.map(stepped, twins))
    stepped(alone)
    assert physics.model.opt.disableflags == flags  # whose sensors were off for both, once threads had met here
    for twin in twins:
        assert_array_equal(twin.data.cfrc_ext, alone.data.cfrc_ext)
        assert_array_equal(twin.data.qpos, alone.data.qpos)
