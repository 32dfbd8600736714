"""Networks as plain pytrees of JAX: a network is a tuple of layers, a layer a dictionary of arrays.

A layer has `weight` (inputs, outputs) and `bias` (outputs,), and `scale` and `offset` (outputs,) where a norm follows:
a batch norm if it has `mean` and `variance` (outputs,), too, and no bias, else a layer norm. NumPy draws the weights,
so they depend on a seed alone.
"""

import math
from collections.abc import Mapping, Sequence

import jax
import jax.numpy as jnp
import numpy as np

EPSILON = 1e-5  # of a norm
ACTIVATION = "elu"  # of networks that act

ACTIVATIONS = {"relu": jax.nn.relu, "elu": jax.nn.elu}


def xavier(random: np.random.Generator, inputs: int, outputs: int, gain: float = 1.0) -> np.ndarray:
    """Draw a weight (inputs, outputs), uniform within gain sqrt(6 / (inputs + outputs)) (Glorot and Bengio, 2010)."""
    bound = gain * math.sqrt(6.0 / (inputs + outputs))
    return random.uniform(-bound, bound, (inputs, outputs)).astype(np.float32)


def orthogonal(random: np.random.Generator, inputs: int, outputs: int, gain: float = 1.0) -> np.ndarray:
    """Draw a weight (inputs, outputs) whose shorter side is orthonormal, times gain (Saxe et al., 2014)."""
    q, r = np.linalg.qr(random.standard_normal((max(inputs, outputs), min(inputs, outputs))))
    q = q * np.sign(np.diagonal(r))
    return (gain * (q if inputs >= outputs else q.T)).astype(np.float32)


INITIALIZERS = {"xavier": xavier, "orthogonal": orthogonal}


def make_layer(weight: np.ndarray, layer_norm: bool = False) -> dict[str, np.ndarray]:
    """Return a layer of a weight (inputs, outputs), with biases 0."""
    outputs = weight.shape[1]
    norm = {"scale": np.ones(outputs, np.float32), "offset": np.zeros(outputs, np.float32)} if layer_norm else {}
    return {"weight": weight, "bias": np.zeros(outputs, np.float32), **norm}


def make_linear_layer(weight: np.ndarray, bias: np.ndarray) -> dict[str, np.ndarray]:
    """Return a layer of a weight (inputs, outputs) and biases (outputs,)."""
    return {"weight": weight, "bias": bias}


def equalizing_scale(sizes: Sequence[int]) -> np.ndarray:
    """Return factors of normalized numbers with which the variances of all parts have the same sum, float32.

    Their mean square is 1, so that gains of first weights hold.

    Args:
        sizes: of the parts, in order.
    """
    counts = [count for count in sizes if count]
    squares = [sum(counts) / (len(counts) * count) for count in counts]
    return np.sqrt(np.repeat(squares, counts)).astype(np.float32)


def mlp(
    random: np.random.Generator,
    sizes: Sequence[int],
    initial: str = "xavier",
    layer_norm: bool = False,
    gain: float = 1.0,
    last_gain: float = 1.0,
) -> tuple[dict[str, np.ndarray], ...]:
    """Draw a multilayer perceptron: for each layer its weight (inputs, outputs), bias (outputs,) and norm, if any.

    Args:
        random: to draw from.
        sizes: of the input, the hidden layers and the output.
        initial: of the weights, a name of `INITIAL`.
        layer_norm: whether hidden layers have one.
        gain: of hidden layers.
        last_gain: of the output.
    """
    draw = INITIALIZERS[initial]
    *pairs, last = zip(sizes[:-1], sizes[1:], strict=True)
    hidden = [make_layer(draw(random, *pair, gain), layer_norm) for pair in pairs]
    return *hidden, make_layer(draw(random, *last, last_gain))


def linear(layer: Mapping, x):
    """Return weight and bias, if there is one, applied to x (..., inputs)."""
    return x @ layer["weight"] + layer.get("bias", 0.0)


def apply_hidden_layers(
    layers: Sequence[Mapping], x, activation: str = "relu", kept=None, dropout: float = 0.0, legs: bool = False
):
    """Return the output of hidden layers for x (..., inputs): linear, dropout, layer norm if it has one, activation.

    Args:
        layers: of the network.
        x: (..., inputs)
        activation: a name of `ACTIVATIONS`.
        kept: booleans (layers, ..., outputs), the units that dropout keeps; None for no dropout.
        dropout: share of the units that it drops.
        legs: whether legs, the axis before the last, share what the first layer finds.
    """
    for index, each in enumerate(layers):
        x = linear(each, x)
        if kept is not None:
            x = drop_units(x, kept[index], dropout)
        x = normalize_and_activate(each, x, activation)
        x = share_between_legs(x) if legs and index == 0 else x
    return x


def share_between_legs(x):
    """Return units (..., legs, units) of which the second half is the mean over legs."""
    own, common = jnp.split(x, [x.shape[-1] // 2], axis=-1)
    return jnp.concatenate([own, jnp.broadcast_to(common.mean(axis=-2, keepdims=True), common.shape)], axis=-1)


def body_outputs(outputs, legs: bool):
    """Return the outputs (..., outputs) of a body; if they are those of its legs (..., legs, outputs), their means."""
    return outputs.mean(axis=-2) if legs else outputs


def drop_units(x, kept, dropout: float):
    """Return x with 0 where units are not kept, and the others divided by 1 - dropout."""
    return jnp.where(kept, x * (1.0 / (1.0 - dropout)), 0.0)


def normalize_and_activate(layer: Mapping, x, activation: str):
    """Return x (..., outputs) after a layer's norm, if it has one, and an activation."""
    if "scale" in layer:
        x = x - (layer["mean"] if "mean" in layer else x.mean(axis=-1, keepdims=True))
        variance = layer["variance"] if "mean" in layer else (x * x).mean(axis=-1, keepdims=True)
        x = x * jax.lax.rsqrt(variance + EPSILON) * layer["scale"] + layer["offset"]
    return ACTIVATIONS[activation](x)


def forward(layers: Sequence[Mapping], x, activation: str = "relu"):
    """Return the output of a multilayer perceptron for x (..., inputs)."""
    return linear(layers[-1], apply_hidden_layers(layers[:-1], x, activation))


def flatten_tree(prefix: str, tree) -> dict[str, np.ndarray]:
    """Return the arrays of a pytree by name, prefix/path/to/array: part of a checkpoint."""
    leaves, _ = jax.tree_util.tree_flatten_with_path(tree)
    return {f"{prefix}{_text(path)}": np.asarray(leaf) for path, leaf in leaves}


def restore_tree(prefix: str, template, arrays: Mapping[str, np.ndarray]):
    """Return a pytree like the template with the arrays that `flatten_tree` gave.

    Raises:
        KeyError, ValueError: an array is missing or has another shape.
    """
    leaves, structure = jax.tree_util.tree_flatten_with_path(template)
    values = []
    for path, leaf in leaves:
        value, like = arrays[f"{prefix}{_text(path)}"], np.asarray(leaf)
        if (value.shape, value.dtype) != (like.shape, like.dtype):
            raise ValueError(f"{prefix}{_text(path)}: expected {like.dtype} {like.shape}")
        values.append(jnp.asarray(value))
    return jax.tree_util.tree_unflatten(structure, values)


def _text(path) -> str:
    return "/" + jax.tree_util.keystr(path, simple=True, separator="/")


# Former names, which learners of other packages may use.
named = flatten_tree
restored = restore_tree
