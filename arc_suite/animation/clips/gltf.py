"""Binary glTF 2.0 files: arrays as accessors, and the container.

The format is that of the Khronos Group, "glTF 2.0 Specification" (2021).
"""

import json
import struct
from typing import Any

import numpy as np

ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963  # what a buffer view is for: attributes of vertices, indices

_COMPONENTS = {np.dtype("u1"): 5121, np.dtype("<u2"): 5123, np.dtype("<u4"): 5125, np.dtype("<f4"): 5126}
_TYPES = {(): "SCALAR", (2,): "VEC2", (3,): "VEC3", (4,): "VEC4", (4, 4): "MAT4"}
_ALIGNED = 4  # bytes


class Document:
    """A glTF document that grows: its JSON, and the one buffer that its accessors look into.

    Attributes:
        json: top-level properties by name.
    """

    def __init__(self, generator: str):
        """Begin a document.

        Args:
            generator: what makes it, for the file's `asset`.
        """
        self.json: dict[str, Any] = {"asset": {"version": "2.0", "generator": generator}}
        self._buffer = bytearray()

    def add(self, kind: str, value: dict) -> int:
        """Append an object to a top-level list such as `nodes`, and return its index."""
        listed = self.json.setdefault(kind, [])
        listed.append(value)
        return len(listed) - 1

    def accessor(
        self, values: np.ndarray, target: int | None = None, bounds: bool = False, normalized: bool = False
    ) -> int:
        """Append an array, and return the index of its accessor.

        Args:
            values: (n, ...), of type uint8, uint16, uint32 or float32; matrices (n, 4, 4) go in by columns.
            target: `ARRAY_BUFFER`, `ELEMENT_ARRAY_BUFFER` or None.
            bounds: tell the least and the greatest value, as positions and times have to.
            normalized: integers stand for shares of the greatest one.
        """
        values = np.ascontiguousarray(values)
        data = values.swapaxes(-1, -2) if values.shape[1:] == (4, 4) else values
        view = {"buffer": 0, "byteOffset": len(self._buffer), "byteLength": values.nbytes}
        if target is not None:
            view["target"] = target
        self._buffer += data.tobytes()
        self._buffer += bytes(-len(self._buffer) % _ALIGNED)
        component, kind = _COMPONENTS[values.dtype], _TYPES[values.shape[1:]]
        accessor: dict[str, Any] = {"bufferView": self.add("bufferViews", view), "componentType": component}
        accessor |= {"count": len(values), "type": kind}
        if normalized:
            accessor["normalized"] = True
        if bounds:
            flat = values.reshape(len(values), -1)
            accessor |= {"min": flat.min(axis=0).tolist(), "max": flat.max(axis=0).tolist()}
        return self.add("accessors", accessor)

    def glb(self) -> bytes:
        """Return the file."""
        content = self.json | {"buffers": [{"byteLength": len(self._buffer)}]}
        text = json.dumps(content, separators=(",", ":"), allow_nan=False).encode()
        text += b" " * (-len(text) % _ALIGNED)
        chunks = b"".join(
            struct.pack("<II", len(data), kind) + data
            for kind, data in ((0x4E4F534A, text), (0x004E4942, self._buffer))
        )
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
