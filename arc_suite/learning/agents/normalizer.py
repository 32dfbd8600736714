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
    """Moments of vectors.

    Attributes:
        count: () number of the vectors.
        mean: (size,)
        squares: (size,) sum of the squared deviations from the mean.
    """

    count: np.ndarray
    mean: np.ndarray
    squares: np.ndarray

    @classmethod
    def empty(cls, size: int) -> Self:
        """Return the moments before the first vector."""
        return cls(np.zeros(()), np.zeros(size), np.zeros(size))

    def with_vectors(self, vectors: np.ndarray) -> Self:
        """Return the moments with more vectors (..., size) (Chan, Golub and LeVeque, 1979)."""
        vectors = vectors.reshape(-1, vectors.shape[-1])
        new_count = len(vectors)
        new_mean = np.asarray(vectors.mean(axis=0, dtype=float), float)  # of NumPy or JAX
        new_squares = np.asarray(((vectors - new_mean) ** 2).sum(axis=0), float)
        count = self.count + new_count
        difference = new_mean - self.mean
        return Moments(
            count,
            self.mean + difference * (new_count / count),
            self.squares + new_squares + difference**2 * (self.count * new_count / count),
        )

    def normalizer(self) -> Normalizer:
        """Return the normalizer of such vectors, float32; before the first vector its factors are 1."""
        deviation = np.sqrt(self.squares / max(self.count, 1.0))
        factor = 1.0 / np.maximum(deviation, _MIN_DEVIATION) if self.count else np.ones_like(deviation)
        return Normalizer(self.mean.astype(np.float32), factor.astype(np.float32), np.array(LIMIT, np.float32))
