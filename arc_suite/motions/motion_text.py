"""Motions as text: settings of a task hold it in place of a file, so that runs and policy files need no other file."""

import base64
import functools
import json
import math
import os
import zlib
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from arc_suite import checks, parsers
from arc_suite.motions.motion import MAX_FRAMES, Motion, array_shapes, check_motion
from arc_suite.motions.motion_files import EXTENSION, NAMES, SCALARS, TEXTS, load, read_names

MAX_TEXT = 1 << 23  # characters

_MAX_COLUMNS = 1 << 12  # numbers of a frame


def is_text(word: Any) -> bool:
    """Return whether a motion is given as text."""
    return isinstance(word, str) and word.startswith("{")


def to_text(motion: Motion) -> str:
    """Return a motion as text, without loss.

    Raises:
        ValueError: more frames than a text may have, or `from_text` would refuse the motion.
    """
    fields = check_motion(motion)._asdict()
    shapes = array_shapes(motion.frames, len(motion.joint_names), len(motion.leg_names))
    arrays = [fields.pop(name) for name in shapes]
    numbers = np.concatenate([array.astype("<f8").ravel() for array in arrays])
    compressed = zlib.compress(numbers.tobytes(), 9)
    fields |= {name: float(fields[name]) for name in SCALARS} | {"loops": bool(motion.loops)}  # also of NumPy's types
    fields |= {"frames": motion.frames, "numbers": base64.b64encode(compressed).decode()}
    text = json.dumps(fields)
    if len(text) > MAX_TEXT:
        raise ValueError(f"motion {motion.name!r}: expected at most {MAX_TEXT} characters as text, got {len(text)}")
    return text


@functools.lru_cache(maxsize=32)
def from_text(text: str) -> Motion:
    """Return the motion of a text. Its arrays are read-only, as the same motion is returned again.

    Raises:
        ValueError: a text that is too long or damaged.
    """
    if len(text) > MAX_TEXT:
        raise ValueError(f"motion: expected at most {MAX_TEXT} characters, got {len(text)}")
    with parsers.guard("motion: expected a name, a file or a motion as text"):
        return _read(checks.mapping("motion", json.loads(text)))


def read(word: Any) -> Motion:
    """Return the motion of a file's path, a text or an `os.PathLike`, or of a motion as text.

    Raises:
        ValueError: no path, or a file or a text without a motion.
        OSError: the file cannot be read.
    """
    if isinstance(word, str | os.PathLike) and names_file(word):
        return load(word)
    if not is_text(word):
        expected = f"expected the path of a file {EXTENSION} or a motion as text"
        raise ValueError(f"motion: {expected}, got {checks.preview(word)}")
    return from_text(word)


def embed(words: Any) -> Any:
    """Return the words of a setting, one or a list, with the motion of every file as text.

    Raises:
        ValueError: as `read`.
        OSError: a file cannot be read.
    """
    return _map_words(lambda word: to_text(load(word)) if names_file(word) else word, words)


def names_file(words: Any) -> bool:
    """Return whether a word, or one of a list, is the path of a file."""
    if isinstance(words, list | tuple):
        return any(map(names_file, words))
    if isinstance(words, os.PathLike):
        return True
    return isinstance(words, str) and words.lower().endswith(EXTENSION) and not is_text(words)


def label(words: Any) -> Any:
    """Return the words of a setting with the name of every motion in place of its text."""
    return _map_words(lambda word: from_text(word).name if is_text(word) else word, words)


def _map_words(function: Callable[[Any], Any], words: Any) -> Any:
    """Return the value of a function for a word, or a list of its values for those of a list."""
    return [function(word) for word in words] if isinstance(words, list | tuple) else function(words)


def _read(fields: Mapping[str, Any]) -> Motion:
    """Return the motion of fields by name; damaged ones raise anything."""
    names = {name: read_names(name, np.array(fields[name], str), 1) for name in NAMES}
    texts = {name: read_names(name, np.array(fields[name], str), 0)[0] for name in TEXTS}
    frames = checks.integer("frames", fields["frames"], 2, MAX_FRAMES)
    shapes = array_shapes(frames, len(names["joint_names"]), len(names["leg_names"]))
    sizes = [math.prod(shape) for shape in shapes.values()]
    if sum(sizes) > frames * _MAX_COLUMNS:
        raise ValueError(f"expected at most {_MAX_COLUMNS} numbers in a frame")
    num_bytes = 8 * sum(sizes)
    content = zlib.decompressobj().decompress(base64.b64decode(fields["numbers"], validate=True), num_bytes + 1)
    if len(content) != num_bytes:
        raise ValueError(f"expected {num_bytes} bytes of numbers, got {len(content)}")
    numbers = np.split(np.frombuffer(content, "<f8").astype(float), np.cumsum(sizes)[:-1])
    arrays = {name: part.reshape(shapes[name]) for name, part in zip(shapes, numbers, strict=True)}
    arrays["planted"] = arrays["planted"] > 0.5
    for array in arrays.values():
        array.flags.writeable = False
    motion_fields: dict[str, Any] = {**texts, **names, **arrays}
    for name in SCALARS:
        motion_fields[name] = checks.number(name, fields[name])
    return check_motion(Motion(loops=checks.boolean("loops", fields["loops"]), **motion_fields))
