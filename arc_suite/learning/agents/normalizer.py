"""Running mean and variance of observations, for normalized inputs of networks."""

from typing import Any, NamedTuple, Self

import numpy as np

LIMIT = 5.0  # bound of a normalized number, in standard deviations
_MIN_DEVIATION = 1e-3  # lower bound of the standard deviation, for near-constant inputs


class Normalizer(NamedTuple):
    """Normalizes vectors of NumPy, of JAX or of a traced graph: (x - mean) * factor, within +-limit.

    Attributes:
        mean: (size,)
        factor: (size,)
        limit: ()
    """

    mean: Any
    factor: Any
    limit: Any

    def __call__(self, vectors):
        """Return vectors (..., size) normalized."""
        return ((vectors - self.mean) * self.factor).clip(-self.limit, self.limit)


class Moments(NamedTuple):
    """Moments of vectors: in double precision with NumPy, in JAX's precision with JAX, also in a compiled function.

    Attributes:
        count: () number of the vectors.
        mean: (size,)
        squares: (size,) sum of the squared deviations from the mean.
    """

    count: Any
    mean: Any
    squares: Any

    @classmethod
    def empty(cls, size: int) -> Self:
        """Return the moments before the first vector."""
        return cls(np.zeros(()), np.zeros(size), np.zeros(size))

    def with_vectors(self, vectors) -> Self:
        """Return the moments with more vectors (..., size) (Chan, Golub and LeVeque, 1979)."""
        vectors = vectors.reshape(-1, vectors.shape[-1])
        new_count = len(vectors)
        new_mean = vectors.mean(axis=0, dtype=float)
        new_squares = ((vectors - new_mean) ** 2).sum(axis=0, dtype=float)
        count = self.count + new_count
        difference = new_mean - self.mean
        return Moments(
            count,
            self.mean + difference * (new_count / count),
            self.squares + new_squares + difference**2 * (self.count * new_count / count),
        )

    def normalizer(self) -> Normalizer:
        """Return the normalizer of such vectors, float32; before the first vector its factors are 1."""
        xp = self.mean.__array_namespace__()
        deviation = xp.sqrt(self.squares / xp.maximum(self.count, 1.0))
        factor = xp.where(self.count > 0.0, 1.0 / xp.maximum(deviation, _MIN_DEVIATION), 1.0)
        return Normalizer(self.mean.astype(xp.float32), factor.astype(xp.float32), xp.asarray(LIMIT, dtype=xp.float32))
