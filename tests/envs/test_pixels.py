"""Pictures through the camera `eye` as observations of every kind of environment."""

import gymnasium
import numpy as np
import pytest
from dm_control.suite.wrappers import pixels
from gymnasium.wrappers import AddRenderObservation
from numpy.testing import assert_array_equal
from refusals import refused

import arc_suite
from arc_suite.envs.pixels import with_pixels

SIZE = {"width": 64, "height": 64, "camera_id": "eye"}
SHAPES = {"rgb_array": ("pixels", (64, 64, 3), np.uint8), "depth_array": ("depth", (64, 64), np.float32)}


@pytest.mark.parametrize("mode", SHAPES)
def test_one_environment_sees_what_a_vector_sees(mode):
    key, shape, kind = SHAPES[mode]
    options = {"render_mode": mode, "task_kwargs": {"kicks": 1.0}, **SIZE}
    single = with_pixels(gymnasium.make("arc_suite/tick-navigate-v0", **options))
    vector = with_pixels(gymnasium.make_vec("arc_suite/tick-navigate-v0", num_envs=2, **options))
    (one, _), (many, _) = single.reset(seed=6), vector.reset(seed=5)
    for _ in range(3):
        assert one.keys() == many.keys() == {"state", key}
        assert one in single.observation_space and many in vector.observation_space
        assert (one[key].shape, one[key].dtype) == (shape, kind)
        for name, array in one.items():
            assert_array_equal(many[name][1], array)
        assert not np.array_equal(*many[key])
        one, *_ = single.step(np.zeros(18))
        many, *_ = vector.step(np.zeros((2, 18)))
    assert single.unwrapped.task.split(one["state"]).keys() == single.unwrapped.task.sizes.keys()
    single.close(), vector.close()


def test_wrappers_of_libraries_see_the_same():
    options = {"render_mode": "rgb_array", **SIZE}
    ours = with_pixels(gymnasium.make("arc_suite/leaper-steer-v0", **options))
    theirs = AddRenderObservation(gymnasium.make("arc_suite/leaper-steer-v0", **options), render_only=False)
    dm = pixels.Wrapper(
        arc_suite.load("leaper", "steer", {"random": 3}), pixels_only=False, render_kwargs={**SIZE, "depth": True}
    )
    expected, found = ours.reset(seed=3)[0], theirs.reset(seed=3)[0]
    assert_array_equal(expected["pixels"], found["pixels"])
    seen = dm.reset().observation["pixels"]
    assert (seen.shape, seen.dtype) == ((64, 64), np.float32) and 0.0 < seen.min() < 1.0


def test_different_bodies_keep_their_named_observations():
    envs = with_pixels(
        gymnasium.make_vec(
            "arc_suite/bodies-walk-v0", num_envs=2, bodies="tick,leaper", render_mode="rgb_array", **SIZE
        )
    )
    observations, _ = envs.reset(seed=0)
    assert observations in envs.observation_space
    assert observations.keys() == {"legs", "torso", "command", "pixels"}


def test_what_has_no_pictures_is_refused():
    with refused("render_mode: pixels need one of rgb_array, depth_array, got None"):
        with_pixels(gymnasium.make("arc_suite/tick-walk-v0"))
    with refused("autoreset_mode: pixels need NextStep or Disabled, got SameStep"):
        with_pixels(
            gymnasium.make_vec(
                "arc_suite/tick-walk-v0", num_envs=2, render_mode="rgb_array", autoreset_mode="SameStep", **SIZE
            )
        )
