"""Binary glTF 2.0 files: arrays as accessors, and the container.

The format is that of the Khronos Group, "glTF 2.0 Specification" (2021).
"""

import json
import struct
from typing import Any

import numpy as np

# What a buffer view is for: glTF's numbers.
ARRAY_BUFFER = 34962  # attributes of vertices
ELEMENT_ARRAY_BUFFER = 34963  # indices

_COMPONENT_TYPES = {np.dtype("u1"): 5121, np.dtype("<u2"): 5123, np.dtype("<u4"): 5125, np.dtype("<f4"): 5126}
_ELEMENT_TYPES = {(): "SCALAR", (2,): "VEC2", (3,): "VEC3", (4,): "VEC4", (4, 4): "MAT4"}  # by the shape of one
_ALIGNMENT = 4  # bytes

_MAGIC = b"glTF"
_VERSION = 2
_HEADER_BYTES = 12
_JSON_CHUNK = 0x4E4F534A
_BINARY_CHUNK = 0x004E4942


class Document:
    """A glTF document that grows: its JSON, and the one buffer that holds its arrays.

    Attributes:
        json: top-level properties by name.
    """

    def __init__(self, generator: str):
        """Begin a document.

        Args:
            generator: name of the program that makes it, for the file's `asset`.
        """
        self.json: dict[str, Any] = {"asset": {"version": "2.0", "generator": generator}}
        self._buffer = bytearray()

    def add(self, kind: str, value: dict) -> int:
        """Append an object to a top-level list such as `nodes`, and return its index."""
        objects = self.json.setdefault(kind, [])
        objects.append(value)
        return len(objects) - 1

    def accessor(
        self, values: np.ndarray, target: int | None = None, bounds: bool = False, normalized: bool = False
    ) -> int:
        """Append an array, and return the index of its accessor.

        Args:
            values: (n, ...), of type uint8, uint16, uint32 or float32; matrices (n, 4, 4) are stored by columns.
            target: `ARRAY_BUFFER`, `ELEMENT_ARRAY_BUFFER` or None.
            bounds: whether to write the least and the greatest values, which positions and times need.
            normalized: whether integers stand for shares of the greatest one.
        """
        values = np.ascontiguousarray(values)
        element_shape = values.shape[1:]
        stored = values.swapaxes(-1, -2) if element_shape == (4, 4) else values
        view = {"buffer": 0, "byteOffset": len(self._buffer), "byteLength": values.nbytes}
        if target is not None:
            view["target"] = target
        self._buffer += stored.tobytes()
        self._buffer += bytes(_padding(len(self._buffer)))
        accessor: dict[str, Any] = {
            "bufferView": self.add("bufferViews", view),
            "componentType": _COMPONENT_TYPES[values.dtype],
            "count": len(values),
            "type": _ELEMENT_TYPES[element_shape],
        }
        if normalized:
            accessor["normalized"] = True
        if bounds:
            flat = values.reshape(len(values), -1)
            accessor["min"] = flat.min(axis=0).tolist()
            accessor["max"] = flat.max(axis=0).tolist()
        return self.add("accessors", accessor)

    def glb(self) -> bytes:
        """Return the binary file."""
        content = self.json | {"buffers": [{"byteLength": len(self._buffer)}]}
        text = json.dumps(content, separators=(",", ":"), allow_nan=False).encode()
        text += b" " * _padding(len(text))
        chunks = _chunk(_JSON_CHUNK, text) + _chunk(_BINARY_CHUNK, self._buffer)
        header = struct.pack("<4sII", _MAGIC, _VERSION, _HEADER_BYTES + len(chunks))
        return header + chunks


def _padding(length: int) -> int:
    """Return how many bytes to add for a length that is aligned."""
    return -length % _ALIGNMENT


def _chunk(kind: int, data: bytes | bytearray) -> bytes:
    """Return a chunk of a binary file: its length, its kind and its data."""
    return struct.pack("<II", len(data), kind) + data
