"""Running moments of observations."""

import numpy as np
from numpy.testing import assert_allclose

from arc_suite.learning.agents.normalizer import LIMIT, Moments


def test_moments_of_parts_are_those_of_the_whole():
    random = np.random.default_rng(0)
    whole = (100.0 + random.normal(size=(60, 5)) * (1e-2, 1.0, 10.0, 0.0, 3.0)).astype(np.float32)
    moments = Moments.empty(5)
    for part in (whole[:1], whole[1:31].reshape(2, 15, 5), whole[31:]):
        moments = moments.with_vectors(part)
    assert_allclose(moments.mean, whole.mean(axis=0, dtype=float), rtol=1e-12)
    assert_allclose(moments.squares / 60, whole.var(axis=0, dtype=float), rtol=1e-9, atol=1e-12)


def test_it_normalizes_within_bounds_and_leaves_alone_what_never_moves():
    random = np.random.default_rng(0)
    vectors = (random.normal(size=(5000, 3)) * (2.0, 1e-2, 0.0) + (5.0, -1.0, 7.0)).astype(np.float32)
    normalize = Moments.empty(3).with_vectors(vectors).normalizer()
    seen = normalize(vectors)
    assert_allclose(seen[:, :2].std(axis=0), 1.0, atol=1e-2)
    assert_allclose(seen.mean(axis=0), 0.0, atol=1e-3)
    assert (seen[:, 2] == 0.0).all()
    assert_allclose(normalize(np.float32([[1e3, -1e3, 7.0]])), [[LIMIT, -LIMIT, 0.0]], atol=1e-3)


def test_before_the_first_vector_nothing_is_changed_within_bounds():
    vectors = np.float32([[0.5, -4.0, 2.0]])
    assert_allclose(Moments.empty(3).normalizer()(vectors), vectors)
