"""Functions of trees: numbers and arrays in NamedTuples and tuples, or None. The memories of tasks are trees."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np


def map_leaves(function: Callable, tree, *other_trees) -> Any:
    """Return the tree of a function's results for the leaves of a tree.

    Args:
        function: from a leaf of each tree to a leaf of the result.
        tree: any tree.
        *other_trees: trees of the same structure.
    """
    if isinstance(tree, tuple):
        items = zip(tree, *other_trees, strict=True)
        return rebuild(tree, [map_leaves(function, *branches) for branches in items])
    if tree is None:
        return None
    return function(tree, *other_trees)


def entry(tree, index: int) -> Any:
    """Return the tree of the leaves' entries at an index of their first axis."""
    return map_leaves(lambda leaf: leaf[index], tree)


def where(mask: np.ndarray, tree, other_tree) -> Any:
    """Return a tree with the entries of one tree where a mask is true, and those of another tree elsewhere.

    Args:
        mask: (num_envs,) booleans.
        tree: its leaves are arrays with a leading axis of num_envs.
        other_tree: other tree of the same structure.
    """
    if mask.all():
        return tree

    def choose_entries(leaf, other_leaf):
        leaf_mask = mask.reshape(-1, *[1] * (leaf.ndim - 1))  # broadcasts to the leaf
        return np.where(leaf_mask, leaf, other_leaf)

    return map_leaves(choose_entries, tree, other_tree)


def leaves(tree) -> Iterator:
    """Yield the numbers and arrays of a tree, depth first."""
    if isinstance(tree, tuple):
        for branch in tree:
            yield from leaves(branch)
    elif tree is not None:
        yield tree


def rebuild(like: tuple, items: list) -> tuple:
    """Return a tuple of the same class as `like`, a plain tuple or a NamedTuple, with other items."""
    if hasattr(like, "_fields"):
        return type(like)(*items)
    return tuple(items)
