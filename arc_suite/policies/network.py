"""Policies that are networks: layers of numbers, evaluated by NumPy, however they were trained.

A policy file is an archive of arrays with one JSON text:

    robot, task, task_kwargs    the setup that the policy was trained in
    blocks                      size of every block of the observation, in the order of the input
    layers                      kind of every layer, by whose index its arrays are named

It holds no pickle and no code, so reading a file of others runs nothing.
"""

import json
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from arc_suite import archives, checks, files, registry
from arc_suite.envs.setup import Setup
from arc_suite.tasks import tokens

PACKAGED = Path(__file__).with_name("packaged")  # policy files that come with the package

EXTENSION = ".npz"
FILE = f"policy{EXTENSION}"  # in the folder of a run

EPSILON = 1e-5  # of a layer norm, as in PyTorch

_MAX_BYTES = 1 << 28  # of a file, unpacked


class Layer(NamedTuple):
    """A layer of a network.

    Attributes:
        kind: a name of `KINDS`.
        arrays: what it computes with, float32.
    """

    kind: str
    arrays: tuple[np.ndarray, ...] = ()


def _linear(x, weight, bias):
    # Not a product of matrices: BLAS rounds by the number of environments and threads.
    return np.einsum("ri,io->ro", x, weight) + bias


def _layer_norm(x, scale, offset):
    x = x - x.mean(axis=-1, keepdims=True)
    return x / np.sqrt((x * x).mean(axis=-1, keepdims=True) + np.float32(EPSILON)) * scale + offset


def _legs(x, first, first_bias, second, second_bias, own, mean, bias, last, last_bias):
    """The network of `agents.architectures.PerLeg`, computed for the legs that there are."""
    inputs, mask = tokens.leg_inputs(x)
    there = mask.any(axis=-1)
    found = _elu(_linear(_elu(_linear(inputs[there], first, first_bias)), second, second_bias))
    features = np.zeros((*there.shape, found.shape[-1]), np.float32)
    features[there] = found
    context = _linear(features.sum(axis=1) / there.sum(axis=1, dtype=np.float32)[:, None], mean, bias)
    hidden = np.einsum("ri,io->ro", found, own) + context[np.nonzero(there)[0]]
    outputs = np.zeros(mask.shape, np.float32)
    outputs[there] = _linear(_elu(hidden), last, last_bias)
    return (outputs * mask).reshape(len(x), -1)


def _elu(x):
    return np.where(x > 0.0, x, np.expm1(np.minimum(x, np.float32(0.0))))


class Kind(NamedTuple):
    """What a layer computes.

    Attributes:
        function: of inputs (num_envs, i) float32 and of arrays; returns outputs (num_envs, o) or (num_envs, i).
        shapes: of the arrays, a letter for each axis.
        sizes: of axes that are given, by letter.
        outputs: number of outputs, where no letter says it.
    """

    function: Callable
    shapes: tuple[str, ...] = ()
    sizes: Mapping[str, int] = {}
    outputs: int | None = None


# Arrays are weight and bias; scale and offset; mean, factor and limit of inputs, which become (x - mean) * factor
# within +-limit.
KINDS = {
    "linear": Kind(_linear, ("io", "o")),
    "layer_norm": Kind(_layer_norm, ("i", "i")),
    "normalise": Kind(lambda x, mean, factor, limit: ((x - mean) * factor).clip(-limit, limit), ("i", "i", "")),
    "relu": Kind(lambda x: np.maximum(x, np.float32(0.0))),
    "elu": Kind(_elu),
    "tanh": Kind(np.tanh),
    "clip": Kind(lambda x: x.clip(np.float32(-1.0), np.float32(1.0))),
    # Of legs: weights and biases of two layers for the features of a leg; of the layer that takes features of the
    # leg, and those of the mean of all; of the last.
    "legs": Kind(
        _legs,
        ("tf", "f", "fg", "g", "gh", "gh", "h", "hj", "j"),
        {"i": sum(tokens.FLAT.values()), "t": tokens.LEG_INPUTS, "j": tokens.JOINTS},
        tokens.LEGS * tokens.JOINTS,
    ),
}


def forward(layers: Sequence[Layer], x: np.ndarray) -> np.ndarray:
    """Return the outputs of layers for inputs (num_envs, n), float32; each is bit-exact as if computed alone."""
    for layer in layers:
        x = KINDS[layer.kind].function(x, *layer.arrays)
    return x


class Network(NamedTuple):
    """A deterministic policy, and the setup it was trained in.

    Attributes:
        layers: from the flat observation (num_envs, size) to actions (num_envs, joints).
        setup: body, or bodies, task and settings.
        blocks: size of every block of the observation by name, in the order of the flat one.
    """

    layers: tuple[Layer, ...]
    setup: Setup
    blocks: Mapping[str, int]

    @property
    def size(self) -> int:
        """Of a flat observation."""
        return sum(self.blocks.values())

    @property
    def joints(self) -> int:
        """Of an action."""
        return self.actions(np.zeros((1, self.size), np.float32)).shape[1]

    def actions(self, observations: np.ndarray) -> np.ndarray:
        """Return actions (num_envs, joints) float32 for flat observations (num_envs, size)."""
        return forward(self.layers, observations.astype(np.float32, copy=False))

    # The protocol of acting.

    def reset(self, indices: Sequence[int], seeds: Sequence[int]) -> None:
        """Start episodes: nothing to do, as the policy remembers nothing."""

    def act(self, observation: Mapping[str, np.ndarray], rewards: np.ndarray) -> np.ndarray:
        """Return the actions (num_envs, joints) of a control step; see `Policy.act`.

        Blocks that its task excluded are left out.

        Raises:
            ValueError: other blocks than those.
        """
        excluded = self.setup.task_kwargs.get("exclude_blocks", ())
        sizes = {name: block.shape[-1] for name, block in observation.items() if name not in excluded}
        if sizes != dict(self.blocks):
            raise ValueError(
                f"policy of {self.setup.kind.name}: expected observation blocks {dict(self.blocks)}, got {sizes}"
            )
        flat = np.concatenate([observation[name] for name in self.blocks], axis=-1, dtype=np.float32)
        return self.actions(flat).astype(float)


def save(path: str | os.PathLike, network: Network) -> None:
    """Write a policy file, atomically.

    Raises:
        OSError: it cannot be written.
    """
    kinds = [layer.kind for layer in network.layers]
    known = network.setup.to_dict() | {"blocks": dict(network.blocks), "layers": kinds}
    arrays: dict[str, Any] = {
        f"{index}.{place}": array
        for index, layer in enumerate(network.layers)
        for place, array in enumerate(layer.arrays)
    }
    with files.writing(path) as temporary:
        np.savez(temporary, policy=np.array(json.dumps(known)), **arrays)


def load(path: str | os.PathLike) -> Network:
    """Read a policy file, or that of a run's folder; nothing that it names is imported.

    Raises:
        ValueError: a damaged file, or a robot, task or arena whose module has not been imported.
        OSError: it cannot be read.
    """
    path = Path(path)
    path = path / FILE if path.is_dir() else path
    try:
        arrays = archives.read(path, _MAX_BYTES)
        known = checks.mapping("policy", json.loads(str(arrays.pop("policy"))))
        blocks = {
            name: checks.integer(f"block {name}", size, 0)
            for name, size in checks.mapping("blocks", known["blocks"]).items()
        }
        layers, width = [], sum(blocks.values())
        for index, kind in enumerate(known["layers"]):
            layer, width = _layer(kind, index, arrays, width)
            layers.append(layer)
        return Network(tuple(layers), Setup.from_dict(known), blocks)
    except FileNotFoundError:
        raise OSError(f"cannot read {path}: no such file") from None
    except registry.NotImported as error:
        raise ValueError(f"policy {path}: {error}") from None
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise ValueError(f"{path}: no policy, or a damaged one: {checks.quoted(error)}") from None


def checkpoint_files(folder: Path) -> list[Path]:
    """Return the policy files of a folder of checkpoints, `FOLDER/<step>/policy.npz`, by their steps."""
    found = [path for path in folder.glob(f"*/{FILE}") if path.parent.name.isdecimal()]
    return sorted(found, key=lambda path: int(path.parent.name))


def _layer(kind: str, index: int, arrays: Mapping[str, np.ndarray], width: int) -> tuple[Layer, int]:
    """Return a layer that takes inputs of a width, and the width of its outputs."""
    made, found = KINDS[checks.name(kind, KINDS, "layer")], []
    sizes = {"i": width} | dict(made.sizes)
    if sizes["i"] != width:
        raise ValueError(f"layer {index}, {kind}: expected {sizes['i']} inputs, got {width}")
    for place, letters in enumerate(made.shapes):
        array = arrays[f"{index}.{place}"]
        array = array.astype(np.float32) if array.dtype == np.float16 else array  # as packaged ones are stored
        sizes = dict(zip(letters, array.shape, strict=False)) | sizes  # the first array tells an axis' size
        if array.dtype != np.float32 or array.shape != tuple(map(sizes.get, letters)):
            given = f"{array.dtype} {array.shape}"
            raise ValueError(f"layer {index}, {kind}: array {place} does not fit {width} inputs, got {given}")
        if not np.isfinite(array).all():
            raise ValueError(f"layer {index}, {kind}: array {place} is not finite")
        found.append(array)
    return Layer(kind, tuple(found)), made.outputs or sizes.get("o", width)
