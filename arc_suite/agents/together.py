"""Drives many runs at once: those of their calls that are of equal shape are one program.

On a GPU a program that makes the update of one run leaves most of it idle, and one for many takes hardly longer; on a
processor it gains nothing. A program is always of the same width, with copies in the places that nobody takes, so
that the bits of a run depend on that width, and on nothing that the other runs do.
"""

import contextlib
import functools
from collections.abc import Generator, Mapping, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from arc_suite.agents.calls import Call


def together(works: Sequence[Generator[Call, Any, Any]], width: int) -> list[Any]:
    """Make the calls that generators yield, in rounds of one call of each, and return what they return.

    Whatever a generator or a program raises ends all of them; they are closed, and what they hold open with them.

    Args:
        works: each goes on as if it were alone.
        width: calls of one program; more of equal shape are several programs.
    """
    results = [None] * len(works)
    answers = dict.fromkeys(range(len(works)))
    with contextlib.ExitStack() as stack:
        for work in works:
            stack.enter_context(contextlib.closing(work))
        while answers:
            calls = {}
            for index, answer in answers.items():
                try:
                    calls[index] = works[index].send(answer)
                except StopIteration as end:
                    results[index] = end.value
            answers = _answers(calls, width)
    return results


def _answers(calls: Mapping[int, Call], width: int) -> dict[int, Any]:
    """Make calls, and return what each is answered."""
    alike = {}
    for index, call in calls.items():
        leaves, structure = jax.tree.flatten(call.given)
        shapes = tuple((leaf.shape, leaf.dtype) for leaf in leaves)
        alike.setdefault((call.function, call.static, structure, shapes), []).append((index, leaves))
    answers = {}
    for (function, static, structure, _), members in alike.items():
        for first in range(0, len(members), width):
            part = members[first : first + width]
            padded = [leaves for _, leaves in part] + [part[0][1]] * (width - len(part))
            columns = [_column(leaves) for leaves in zip(*padded, strict=True)]
            made = _many(function, static, structure, width, columns)
            answers |= {index: answer for (index, _), answer in zip(part, made, strict=False)}
    return answers


def _column(leaves: Sequence):
    """One argument of several calls: NumPy arrays stacked, for one transfer to the device, others apart."""
    return np.stack(leaves) if all(isinstance(leaf, np.ndarray) for leaf in leaves) else tuple(leaves)


@functools.partial(jax.jit, static_argnums=(0, 1, 2, 3))
def _many(function, static: tuple, structure, width: int, columns: list) -> list:
    stacked = [jnp.stack(column) if isinstance(column, tuple) else column for column in columns]
    with jax.default_matmul_precision("highest"):  # GPUs would round what they multiply to 10 bits
        made = jax.vmap(lambda *leaves: function(*static, *jax.tree.unflatten(structure, leaves)))(*stacked)
    return [jax.tree.map(lambda leaf, place=place: leaf[place], made) for place in range(width)]
