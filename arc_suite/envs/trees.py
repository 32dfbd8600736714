"""Memories of tasks as trees: numbers and arrays in NamedTuples and tuples, or None."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np


def map_leaves(function: Callable, tree, *others) -> Any:
    """Return a tree whose leaves a function makes from the leaves of trees of the same structure."""
    if isinstance(tree, tuple):
        return rebuild(tree, [map_leaves(function, *items) for items in zip(tree, *others, strict=True)])
    return None if tree is None else function(tree, *others)


def entry(tree, index: int) -> Any:
    """Return the tree of the entries that leaves have at an index of their first axis."""
    return map_leaves(lambda leaf: leaf[index], tree)


def where(mask: np.ndarray, there, elsewhere) -> Any:
    """Return a tree that is one in some environments, (num_envs,) booleans, and another in the others."""
    if mask.all():
        return there
    return map_leaves(lambda new, old: np.where(mask.reshape(-1, *[1] * (new.ndim - 1)), new, old), there, elsewhere)


def leaves(tree) -> Iterator:
    """Yield the numbers and arrays of a tree, depth first."""
    if isinstance(tree, tuple):
        for item in tree:
            yield from leaves(item)
    elif tree is not None:
        yield tree


def rebuild(like: tuple, items: list) -> tuple:
    """Return a tuple of the type of another one, with other items."""
    return type(like)(*items) if hasattr(like, "_fields") else tuple(items)
