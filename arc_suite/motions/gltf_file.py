"""Reads animations of skeletons from binary glTF files (.glb) that others may have written, within limits.

The format is that of the Khronos Group, "glTF 2.0 Specification" (2021). Meshes, materials and extensions are not read.
"""

import json
import os
import struct
from typing import Any, NamedTuple

import numpy as np

from arc_suite import checks, files, parsers, rotations
from arc_suite.motions.motion import MAX_FRAMES
from arc_suite.motions.skeletons import FROM_Y_UP, LOOP_SUFFIX, Skeleton, clip_of_animation

EXTENSION = ".glb"
FRAME_RATE = 60.0  # Hz, at which animations are sampled

_MAX_BYTES = 1 << 27
_MAX_NODES = 4096
_MAX_DEPTH = 256  # of nodes below each other
_MAX_ANIMATIONS = 1024
_MAX_VALUES = 1 << 26  # numbers of sampled poses: frames times nodes times 16
_TIME_TOLERANCE = 1e-5  # s

_MAGIC = b"glTF"
_JSON_CHUNK = 0x4E4F534A
_BINARY_CHUNK = 0x004E4942
_FLOAT = 5126
_COMPONENTS: dict[int, np.dtype] = {
    5120: np.dtype("i1"),
    5121: np.dtype("u1"),
    5122: np.dtype("<i2"),
    5123: np.dtype("<u2"),
    _FLOAT: np.dtype("<f4"),
}
_SIZES = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_TRACK_SIZES = {"translation": 3, "rotation": 4, "scale": 3}


class _File(NamedTuple):
    """The JSON and the one buffer of a file."""

    json: dict[str, Any]
    buffer: bytes


class _Track(NamedTuple):
    """A property of a node over time.

    Attributes:
        node: index of the node.
        path: the property: translation, rotation or scale.
        sampler: values and kind of interpolation, as in the file.
        times: (keys,) s.
    """

    node: int
    path: str
    sampler: dict
    times: np.ndarray


def read(path: str | os.PathLike[str], clip: str | None = None) -> Skeleton:
    """Read an animation of a file as a skeleton, sampled at 60 frames a second.

    Args:
        path: path of the file.
        clip: name of the animation, with or without `_loop`; None for the only one.

    Raises:
        ValueError: no such animation, or a damaged file; one line.
        OSError: the file cannot be read.
    """
    data = files.read_bytes(path, _MAX_BYTES)
    with parsers.guard(f"{path}"):
        file = _open(data)
        nodes = _list(file.json, "nodes")
        if len(nodes) > _MAX_NODES:
            raise ValueError(f"nodes: expected at most {_MAX_NODES}, got {len(nodes)}")
        parents = _find_parents(nodes)
        animation = _choose_animation(_list(file.json, "animations"), clip)
        seconds, poses = _sample(file, nodes, animation)
        world_poses = _world_poses(poses, parents)
        joints, bind_poses = _bind_poses(file, nodes, parents)
        return _make_skeleton(animation["name"], seconds, nodes, joints, bind_poses, world_poses[:, joints])


def _open(data: bytes) -> _File:
    """Return the chunks of a binary file."""
    if len(data) > _MAX_BYTES:
        raise ValueError(f"expected at most {_MAX_BYTES} bytes")
    if data[:4] != _MAGIC:
        raise ValueError("expected a binary glTF file")
    chunks: dict[int, bytes] = {}
    place = 12
    while place + 8 <= len(data):
        length, kind = struct.unpack_from("<II", data, place)
        place += 8
        if place + length > len(data):
            raise ValueError(f"a chunk claims {length} bytes, and the file ends after {len(data) - place}")
        chunks.setdefault(kind, data[place : place + length])
        place += length
    text = chunks.get(_JSON_CHUNK, b"")
    if not text:
        raise ValueError("expected a binary glTF file, and there is no JSON in it")
    if len(text) > files.MAX_JSON:
        raise ValueError(f"expected at most {files.MAX_JSON} bytes of JSON")
    content = json.loads(text)
    if not isinstance(content, dict):
        raise ValueError("expected an object of JSON")
    return _File(content, chunks.get(_BINARY_CHUNK, b""))


def _list(content: dict, name: str) -> list[dict]:
    """Return a top-level list of objects; an empty one where it is missing."""
    values = content.get(name, [])
    if not isinstance(values, list) or not all(isinstance(value, dict) for value in values):
        raise ValueError(f"{name}: expected a list of objects")
    return values


def _item(items: list, index: Any, what: str) -> Any:
    """Return an item of a list by an index of the file."""
    return items[checks.integer(what, index, 0, len(items) - 1)]


def _find_parents(nodes: list[dict]) -> list[int | None]:
    """Return the index of the node above each one; None for a root.

    Raises:
        ValueError: a node has two parents, or nodes are below themselves.
    """
    parents: list[int | None] = [None] * len(nodes)
    for parent, node in enumerate(nodes):
        for child in node.get("children", []):
            checks.integer("child of a node", child, 0, len(nodes) - 1)
            if parents[child] is not None:
                raise ValueError(f"node {child} is below two nodes")
            parents[child] = parent
    for index in range(len(nodes)):
        above = parents[index]
        depth = 0
        while above is not None:
            above = parents[above]
            depth += 1
            if depth > _MAX_DEPTH:
                raise ValueError(f"node {index} is below more than {_MAX_DEPTH} others, or below itself")
    return parents


def _choose_animation(animations: list[dict], clip: str | None) -> dict:
    """Return the animation of a clip, by its name or by that without `_loop`.

    Raises:
        ValueError: there is none, or several of this name, or several and no name.
    """
    if len(animations) > _MAX_ANIMATIONS:
        raise ValueError(f"animations: expected at most {_MAX_ANIMATIONS}, got {len(animations)}")
    by_name: dict[str, list[dict]] = {}
    for index, animation in enumerate(animations):
        animation["name"] = str(animation.get("name") or f"animation {index}")
        by_name.setdefault(animation["name"], []).append(animation)
    if not by_name:
        raise ValueError("expected an animation, and there is none")
    if clip is None and len(by_name) > 1:
        raise ValueError(f"clip: expected one of {', '.join(by_name)[:500]}")
    name = next(iter(by_name)) if clip is None else clip
    if f"{name}{LOOP_SUFFIX}" in by_name and name not in by_name:
        name = f"{name}{LOOP_SUFFIX}"
    namesakes = by_name[checks.name(name, by_name, "clip")]
    if len(namesakes) > 1:
        raise ValueError(f"clip: expected one animation {checks.preview(name)}, got {len(namesakes)}; rename them")
    return namesakes[0]


# Poses of nodes.


def _sample(file: _File, nodes: list[dict], animation: dict) -> tuple[float, np.ndarray]:
    """Return the duration of an animation, s, and transforms (frames, nodes, 4, 4) of nodes in those above.

    A node without a track keeps its place, as exporters leave out tracks that are constant.
    """
    tracks = _list_tracks(file, nodes, animation)
    first = min(float(track.times[0]) for track in tracks)
    last = max(float(track.times[-1]) for track in tracks)
    frames = max(1, round((last - first) * FRAME_RATE)) + 1
    if not 2 <= frames <= MAX_FRAMES or frames * len(nodes) * 16 > _MAX_VALUES:
        raise ValueError(f"expected at most {MAX_FRAMES} frames, and fewer of many nodes, got {frames}")
    sample_times = np.linspace(first, last, frames)
    poses = np.tile([_node_transform(node) for node in nodes], (frames, 1, 1, 1))
    values_of_node: dict[int, dict[str, np.ndarray]] = {}
    for track in tracks:
        values_of_node.setdefault(track.node, {})[track.path] = _interpolate(file, track, sample_times)
    for node, values in values_of_node.items():
        poses[:, node] = _transforms(nodes[node], values, frames)
    return last - first, poses


def _list_tracks(file: _File, nodes: list[dict], animation: dict) -> list[_Track]:
    """Return the tracks of places, rotations and scales in an animation; a ValueError if there is none."""
    tracks = []
    for channel in _list(animation, "channels"):
        target = channel["target"]
        path = target.get("path")
        if path not in _TRACK_SIZES or "node" not in target:
            continue  # weights of shapes
        checks.integer("node of a channel", target["node"], 0, len(nodes) - 1)
        sampler = _item(_list(animation, "samplers"), channel["sampler"], "sampler of a channel")
        tracks.append(_Track(target["node"], path, sampler, _read_times(file, sampler["input"])))
    if not tracks:
        raise ValueError("the animation moves no node")
    return tracks


def _read_times(file: _File, accessor: Any) -> np.ndarray:
    times = _read_accessor(file, accessor, 1)[:, 0]
    if not len(times) or (np.diff(times) <= 0.0).any():
        raise ValueError("times of keys: expected numbers that grow")
    return times


def _interpolate(file: _File, track: _Track, sample_times: np.ndarray) -> np.ndarray:
    """Return the values (frames, size) of a track at times (frames,), s, as its kind of interpolation says."""
    kind = track.sampler.get("interpolation", "LINEAR")
    checks.name(kind, ("LINEAR", "STEP", "CUBICSPLINE"), "interpolation")
    size = _TRACK_SIZES[track.path]
    times = track.times
    values = _read_accessor(file, track.sampler["output"], size)
    keys_of_value = 3 if kind == "CUBICSPLINE" else 1
    if len(values) != keys_of_value * len(times):
        raise ValueError(f"expected {keys_of_value * len(times)} values of a track, got {len(values)}")
    if len(times) == 1:
        return np.tile(values[len(values) // 2], (len(sample_times), 1))
    # Times of keys are 32-bit numbers: a sample at a key belongs to that key.
    previous = np.searchsorted(times, sample_times + _TIME_TOLERANCE, side="right").clip(1, len(times) - 1) - 1
    duration = (times[previous + 1] - times[previous])[:, None]
    share = ((sample_times - times[previous])[:, None] / duration).clip(0.0, 1.0)
    if kind == "STEP":
        is_last = sample_times + _TIME_TOLERANCE >= times[-1]
        return np.where(is_last[:, None], values[-1], values[previous])
    if kind == "CUBICSPLINE":
        arriving, points, leaving = values.reshape(len(times), 3, size).swapaxes(0, 1)
        start_slope = duration * leaving[previous]
        end_slope = duration * arriving[previous + 1]
        return _interpolate_cubically(points[previous], points[previous + 1], start_slope, end_slope, share)
    end = values[previous + 1]
    if size == 4:  # the short way round; keys are near each other, so that a line is as good as an arc
        cosines = (values[previous] * end).sum(axis=-1, keepdims=True)
        return _slerp(values[previous], np.where(cosines < 0.0, -end, end), share)
    return (1.0 - share) * values[previous] + share * end


def _interpolate_cubically(start, end, start_slope, end_slope, share) -> np.ndarray:
    """Return values on the cubic curves between two keys with slopes, per interval, at a share of the interval."""
    change = end - start
    bend = start_slope + end_slope - 2.0 * change
    return start + share * (start_slope + share * (change - start_slope - bend + share * bend))


def _slerp(start: np.ndarray, end: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Return unit quaternions on the arcs between others."""
    angle = np.arccos((start * end).sum(axis=-1, keepdims=True).clip(-1.0, 1.0))
    sine = np.maximum(np.sin(angle), 1e-9)
    is_near = angle < 1e-4
    start_share = np.where(is_near, 1.0 - share, np.sin((1.0 - share) * angle) / sine)
    end_share = np.where(is_near, share, np.sin(share * angle) / sine)
    return start_share * start + end_share * end


def _node_transform(node: dict) -> np.ndarray:
    """Return the transform (4, 4) of a node in the one above, as it rests."""
    if "matrix" in node:
        return checks.array("matrix of a node", node["matrix"], 16).reshape(4, 4).T
    return _transforms(node, {}, 1)[0]


def _transforms(node: dict, values: dict[str, np.ndarray], frames: int) -> np.ndarray:
    """Return transforms (frames, 4, 4) of a node with tracks; what has no track is as the node rests."""
    resting = {"translation": (0.0, 0.0, 0.0), "rotation": (0.0, 0.0, 0.0, 1.0), "scale": (1.0, 1.0, 1.0)}
    tracks = {}
    for path, size in _TRACK_SIZES.items():
        value = checks.array(f"{path} of a node", node.get(path, list(resting[path])), size)
        tracks[path] = values.get(path, np.tile(value, (frames, 1)))
    transforms = np.zeros((frames, 4, 4))
    transforms[:, :3, :3] = _rotation_matrices(tracks["rotation"]) * tracks["scale"][:, None]
    transforms[:, :3, 3] = tracks["translation"]
    transforms[:, 3, 3] = 1.0
    return transforms


def _rotation_matrices(quaternions: np.ndarray) -> np.ndarray:
    """Return rotation matrices (n, 3, 3) of quaternions (n, 4), w last, of any length above 0."""
    lengths = np.linalg.norm(quaternions, axis=-1, keepdims=True)
    if not (lengths > 1e-6).all():
        raise ValueError("rotation: expected quaternions above 0")
    return rotations.matrix(np.roll(quaternions / lengths, 1, axis=-1))


def _world_poses(poses: np.ndarray, parents: list[int | None]) -> np.ndarray:
    """Return the transforms (frames, nodes, 4, 4) of nodes in the world."""
    world: dict[int, np.ndarray] = {}

    def find(node: int) -> np.ndarray:
        if node not in world:
            parent = parents[node]
            world[node] = poses[:, node] if parent is None else find(parent) @ poses[:, node]
        return world[node]

    return np.stack([find(node) for node in range(len(parents))], axis=1)


def _bind_poses(file: _File, nodes: list[dict], parents: list[int | None]) -> tuple[list[int], np.ndarray]:
    """Return the nodes that are joints, and the transforms (joints, 4, 4) that they are bound in.

    Without a skin, nodes are bound as they rest.
    """
    skins = _list(file.json, "skins")
    if not skins:
        resting = np.stack([_node_transform(node) for node in nodes])[None]
        return list(range(len(nodes))), _world_poses(resting, parents)[0]
    skin = skins[0]
    joints = list(skin["joints"])
    for joint in joints:
        checks.integer("joint of a skin", joint, 0, len(nodes) - 1)
    inverses = np.tile(np.eye(4), (len(joints), 1, 1))
    if "inverseBindMatrices" in skin:
        inverses = _read_accessor(file, skin["inverseBindMatrices"], 16).reshape(-1, 4, 4).swapaxes(-1, -2)
    if len(inverses) != len(joints) or len(set(joints)) < len(joints):
        raise ValueError(f"expected {len(joints)} different joints with inverse bind matrices, got {len(inverses)}")
    return joints, np.linalg.inv(inverses)


def _read_accessor(file: _File, index: Any, size: int) -> np.ndarray:
    """Return the numbers (count, size) of an accessor, after checks of what it claims."""
    accessor = _item(_list(file.json, "accessors"), index, "accessor")
    if _SIZES.get(accessor.get("type")) != size:
        raise ValueError(f"accessor {index}: expected {size} numbers each, got {checks.preview(accessor.get('type'))}")
    if "sparse" in accessor or "bufferView" not in accessor:
        raise ValueError(f"accessor {index}: expected values in the buffer")
    component = _COMPONENTS.get(accessor.get("componentType"))
    if component is None:
        raise ValueError(f"accessor {index}: unknown type of numbers {checks.preview(accessor.get('componentType'))}")
    view = _item(_list(file.json, "bufferViews"), accessor["bufferView"], "view of the buffer")
    if view.get("buffer") != 0 or "extensions" in view:
        raise ValueError(f"accessor {index}: expected values in the file's own buffer, and not compressed")
    count = checks.integer(f"count of accessor {index}", accessor.get("count"), 0, len(file.buffer))
    start = checks.integer("byteOffset", view.get("byteOffset", 0), 0, len(file.buffer))
    start += checks.integer("byteOffset", accessor.get("byteOffset", 0), 0, len(file.buffer))
    element_bytes = size * component.itemsize
    stride = checks.integer("byteStride", view.get("byteStride", element_bytes), element_bytes, 1 << 16)
    if count and start + stride * (count - 1) + element_bytes > len(file.buffer):
        raise ValueError(f"accessor {index}: claims {count} values, and the buffer has {len(file.buffer)} bytes")
    strides = (stride, component.itemsize)
    stored = np.ndarray((count, size), component, file.buffer, start, strides)
    numbers = stored.astype(float)
    if component.kind != "f":  # integers stand for shares of the greatest one
        numbers = (numbers / np.iinfo(component).max).clip(-1.0)
    if not np.isfinite(numbers).all():
        raise ValueError(f"accessor {index}: expected finite numbers")
    return numbers


def _make_skeleton(
    name: str,
    seconds: float,
    nodes: list[dict],
    joints: list[int],
    bind_poses: np.ndarray,
    poses: np.ndarray,
) -> Skeleton:
    """Return the skeleton of world transforms (frames, joints, 4, 4), in the axes of the suite."""
    turns = poses[..., :3, :3] @ np.linalg.inv(bind_poses[:, :3, :3])
    scales = np.cbrt(np.linalg.det(turns))
    if not (np.isfinite(scales) & (scales > 1e-9)).all():
        raise ValueError("expected poses without mirrors and scales of 0")
    return Skeleton(
        name=clip_of_animation(name),
        frame_rate=(len(poses) - 1) / seconds if seconds > 0.0 else FRAME_RATE,
        loops=name.endswith(LOOP_SUFFIX),
        bones=tuple([str(nodes[joint].get("name", "")) for joint in joints]),
        bind_positions=bind_poses[:, :3, 3] @ FROM_Y_UP.T,
        positions=poses[..., :3, 3] @ FROM_Y_UP.T,
        turns=FROM_Y_UP @ (turns / scales[..., None, None]) @ FROM_Y_UP.T,
    )
