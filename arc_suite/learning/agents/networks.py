"""Networks as plain pytrees of JAX: a network is a tuple of layers, a layer a dictionary of arrays.

A layer has `weight` (inputs, outputs) and `bias` (outputs,). A layer with a norm also has `scale` and `offset`
(outputs,). The norm is a batch norm if the layer has `mean` and `variance` (outputs,); such a layer has no bias.
Otherwise it is a layer norm. NumPy draws the weights, so they depend on a seed alone.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

EPSILON = 1e-5  # added to the variance in a norm
ACTIVATION = "elu"  # of the networks of ppo, dagger and bc

ACTIVATIONS = {"relu": jax.nn.relu, "elu": jax.nn.elu}


def xavier(random: np.random.Generator, inputs: int, outputs: int, gain: float = 1.0) -> np.ndarray:
    """Draw a weight (inputs, outputs), uniform within gain sqrt(6 / (inputs + outputs)) (Glorot and Bengio, 2010)."""
    bound = gain * math.sqrt(6.0 / (inputs + outputs))
    return random.uniform(-bound, bound, (inputs, outputs)).astype(np.float32)


def orthogonal(random: np.random.Generator, inputs: int, outputs: int, gain: float = 1.0) -> np.ndarray:
    """Draw a weight (inputs, outputs) whose shorter side is orthonormal, times gain (Saxe et al., 2014)."""
    longer_side = max(inputs, outputs)
    shorter_side = min(inputs, outputs)
    q, r = np.linalg.qr(random.standard_normal((longer_side, shorter_side)))
    q = q * np.sign(np.diagonal(r))
    weight = q if inputs >= outputs else q.T
    return (gain * weight).astype(np.float32)


INITIALIZERS = {"xavier": xavier, "orthogonal": orthogonal}


def mlp(
    random: np.random.Generator,
    sizes: Sequence[int],
    initial: str = "xavier",
    layer_norm: bool = False,
    gain: float = 1.0,
    last_gain: float = 1.0,
) -> tuple[dict[str, np.ndarray], ...]:
    """Draw the layers of a multilayer perceptron.

    Args:
        random: generator to draw from.
        sizes: sizes of the input, the hidden layers and the output.
        initial: distribution of the weights, a name of `INITIALIZERS`.
        layer_norm: whether hidden layers have a layer norm.
        gain: gain of the weights of hidden layers.
        last_gain: gain of the weights of the output layer.
    """
    draw_weight = INITIALIZERS[initial]
    *hidden_shapes, last_shape = zip(sizes[:-1], sizes[1:], strict=True)
    hidden_layers = [
        make_layer(draw_weight(random, inputs, outputs, gain), layer_norm) for inputs, outputs in hidden_shapes
    ]
    last_inputs, last_outputs = last_shape
    last_layer = make_layer(draw_weight(random, last_inputs, last_outputs, last_gain))
    return *hidden_layers, last_layer


def make_layer(weight: np.ndarray, layer_norm: bool = False) -> dict[str, np.ndarray]:
    """Return a layer with a weight (inputs, outputs), biases 0, and maybe a layer norm that changes no scale."""
    outputs = weight.shape[1]
    layer = {"weight": weight, "bias": np.zeros(outputs, np.float32)}
    if layer_norm:
        layer["scale"] = np.ones(outputs, np.float32)
        layer["offset"] = np.zeros(outputs, np.float32)
    return layer


def make_linear_layer(weight: np.ndarray, bias: np.ndarray) -> dict[str, np.ndarray]:
    """Return a layer with a weight (inputs, outputs) and biases (outputs,)."""
    return {"weight": weight, "bias": bias}


def equalizing_scale(sizes: Sequence[int]) -> np.ndarray:
    """Return factors of normalized numbers that give each part of a vector the same total variance, float32.

    The mean square of the factors is 1, so the gain of the first weights stays as it was drawn.

    Args:
        sizes: sizes of the parts, in order; empty parts do not count.
    """
    part_sizes = [size for size in sizes if size]
    total = sum(part_sizes)
    squares = [total / (len(part_sizes) * size) for size in part_sizes]
    return np.sqrt(np.repeat(squares, part_sizes)).astype(np.float32)


def forward(layers: Sequence[Mapping], x, activation: str = "relu"):
    """Return the output of a multilayer perceptron for x (..., inputs)."""
    return linear(layers[-1], apply_hidden_layers(layers[:-1], x, activation))


def apply_hidden_layers(
    layers: Sequence[Mapping],
    x,
    activation: str = "relu",
    dropout_masks=None,
    dropout: float = 0.0,
    legs: bool = False,
):
    """Return the output of hidden layers for x (..., inputs).

    Each layer is linear; then come dropout, the norm if the layer has one, and the activation.

    Args:
        layers: layers of the network.
        x: (..., inputs)
        activation: a name of `ACTIVATIONS`.
        dropout_masks: booleans (layers, ..., outputs), True for the units that dropout keeps; None for no dropout.
        dropout: share of the units that it drops.
        legs: whether the axis before the last is that of legs, which share half of the first layer's units.
    """
    for index, layer in enumerate(layers):
        x = linear(layer, x)
        if dropout_masks is not None:
            x = drop_units(x, dropout_masks[index], dropout)
        x = normalize_and_activate(layer, x, activation)
        if legs and index == 0:
            x = share_between_legs(x)
    return x


def linear(layer: Mapping, x):
    """Return x (..., inputs) times the weight of a layer, plus its bias if it has one."""
    return x @ layer["weight"] + layer.get("bias", 0.0)


def drop_units(x, mask, dropout: float):
    """Return x where the mask is True, divided by 1 - dropout, and 0 elsewhere."""
    return jnp.where(mask, x * (1.0 / (1.0 - dropout)), 0.0)


def normalize_and_activate(layer: Mapping, x, activation: str):
    """Return x (..., outputs) after a layer's norm, if it has one, and an activation."""
    if "scale" in layer:
        is_batch_norm = "mean" in layer
        mean = layer["mean"] if is_batch_norm else x.mean(axis=-1, keepdims=True)
        x = x - mean
        variance = layer["variance"] if is_batch_norm else (x * x).mean(axis=-1, keepdims=True)
        x = x * jax.lax.rsqrt(variance + EPSILON) * layer["scale"] + layer["offset"]
    return ACTIVATIONS[activation](x)


def share_between_legs(x):
    """Return units (..., legs, units) whose second half is replaced by its mean over legs."""
    leg_units, common_units = jnp.split(x, [x.shape[-1] // 2], axis=-1)
    means = common_units.mean(axis=-2, keepdims=True)
    return jnp.concatenate([leg_units, jnp.broadcast_to(means, common_units.shape)], axis=-1)


def body_outputs(outputs, legs: bool):
    """Return the outputs (..., outputs) of a body.

    Args:
        outputs: (..., outputs) outputs of the body; with `legs`, (..., legs, outputs), which are averaged over legs.
        legs: whether the axis before the last is that of legs.
    """
    return outputs.mean(axis=-2) if legs else outputs


def flatten_tree(prefix: str, tree) -> dict[str, np.ndarray]:
    """Return the arrays of a pytree by name, prefix/path/to/array, as a checkpoint holds them."""
    return {name: np.asarray(leaf) for name, leaf in name_leaves({prefix: tree}).items()}


def name_leaves(tree) -> dict[str, Any]:
    """Return the leaves of a pytree as they are, by name: path/to/leaf."""
    leaves, _ = jax.tree_util.tree_flatten_with_path(tree)
    return {_path_text(path): leaf for path, leaf in leaves}


def restore_tree(prefix: str, template, arrays: Mapping[str, np.ndarray]):
    """Return a pytree with the structure of the template and the arrays that `flatten_tree` named.

    Raises:
        KeyError, ValueError: an array is missing or has another shape.
    """
    template_leaves, structure = jax.tree_util.tree_flatten_with_path(template)
    leaves = []
    for path, template_leaf in template_leaves:
        name = f"{prefix}/{_path_text(path)}"
        array = arrays[name]
        expected = np.asarray(template_leaf)
        if (array.shape, array.dtype) != (expected.shape, expected.dtype):
            shapes = f"expected {expected.dtype} {expected.shape}, got {array.dtype} {array.shape}"
            raise ValueError(f"{name}: {shapes}, which a run of another version may have")
        leaves.append(jnp.asarray(array))
    return jax.tree_util.tree_unflatten(structure, leaves)


def stack_trees(trees: Sequence):
    """Return a pytree whose arrays are those of several pytrees, with a leading axis, on the device."""
    return jax.tree.map(lambda *leaves: jnp.stack(leaves), *trees)


@jax.jit
def select_tree(tree, index):
    """Return one of the pytrees of `stack_trees`."""
    return jax.tree.map(lambda array: array[index], tree)


def _path_text(path) -> str:
    return jax.tree_util.keystr(path, simple=True, separator="/")
