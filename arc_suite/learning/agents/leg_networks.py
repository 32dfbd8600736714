"""Architectures whose networks all legs share; see `architectures`.

A first network maps what a leg sees to features. A second one, the head, maps the features of a leg, and their mean
over all legs, to actions of its joints. Values are means over legs.
"""

import dataclasses
import functools
from collections.abc import Iterable
from typing import NamedTuple, Self

import jax.numpy as jnp
import numpy as np

from arc_suite.bodies import tokens
from arc_suite.bodies.padding import MAX_JOINTS, MAX_LEGS
from arc_suite.learning.agents import critic_blocks as blocks_of_critics
from arc_suite.learning.agents import networks
from arc_suite.learning.agents.networks import ACTIVATION
from arc_suite.learning.agents.normalizer import Moments, Normalizer
from arc_suite.policies.tracing import activate, linear, perceptron
from arc_suite.tasks import Task
from arc_suite.tasks.leg_views import LegViews, leg_views

_GAIN = 2**0.5  # of the weights of hidden layers
_LOWEST_INPUT = -1e4  # less than any number that a leg sees, and finite in policies of 16 bits


@dataclasses.dataclass(frozen=True, eq=False)
class Legs:
    """Networks of the legs of one body, which see an observation as `arc_suite.tasks.leg_views` has it.

    What is learned with one leg holds for all: commands to the side, backward and to turn follow from those forward.

    A view is the vector (..., inputs of all legs) of what the legs see. First come the numbers that actions depend on,
    leg by leg; then the privileged ones, leg by leg.

    Attributes:
        views: views of the legs.
        size: numbers of an observation.
        blocks: number of its blocks; blocks of the views after them are privileged.
        symmetric: whether the networks treat left and right alike, whatever their parameters.
    """

    views: LegViews
    size: int
    blocks: int
    symmetric: bool

    @property
    def legs(self) -> int:
        """Number of legs."""
        return len(self.views.bias)

    @property
    def joints(self) -> int:
        """Numbers of an action."""
        return len(self.views.joints)

    @property
    def features(self) -> int:
        """Numbers that the actions of a leg depend on; they come first in `inputs`."""
        return sum(self.views.sizes[: 1 + self.blocks])  # the size before the blocks is that of the pairs of legs

    @property
    def action_inputs(self) -> int:
        """Numbers of a view that actions depend on; they come first."""
        return self.legs * self.features

    @property
    def inputs(self) -> int:
        """Numbers that a leg sees, privileged ones counted; the size of the moments that normalize them."""
        return sum(self.views.sizes)

    @classmethod
    def of(cls, task: Task, critic_blocks: Iterable[str] = (), symmetric: bool = True) -> Self:
        """Return the architecture for a task.

        Args:
            task: task whose observations they are.
            critic_blocks: names of privileged blocks for networks of values.
            symmetric: whether to treat left and right alike, if the task is symmetric.
        """
        symmetry = blocks_of_critics.mirror_maps(task, critic_blocks) if symmetric else None
        privileged = {f"privileged {name}": task.privileged_blocks[name] for name in critic_blocks}
        views = leg_views(task.scene.body, {**task.blocks, **privileged}, symmetry)
        return cls(views, task.size, len(task.sizes), symmetric=symmetry is not None)

    def view(self, observations):
        """Return the view of observations (..., size), or of observations with privileged blocks after them."""
        has_privileged = observations.shape[-1] != self.size
        count = None if has_privileged else self.action_inputs
        sources, factors, bias = self._flat_views
        # The order of these steps is that of the nodes in policy files.
        view = bias[:count] + observations[..., sources[0, :count]] * factors[0, :count]
        return view + observations[..., sources[1, :count]] * factors[1, :count]

    def draw_policy(self, random, hidden, last_gain=1.0):
        """Draw the parameters of a network of actions."""
        return _draw_parameters(random, (self.features, hidden), self.views.most, last_gain)

    def draw_values(self, random, hidden):
        """Draw the parameters of a network of values."""
        return _draw_parameters(random, (self.inputs, hidden), 1)

    def actions(self, parameters, views):
        """Return the actions (..., joints) for normalized views (..., own or more)."""
        inputs = self._by_leg(views)[..., : self.features] * self.scale
        return self.body_actions(_leg_outputs(parameters, inputs, np.ones(self.legs, bool)))

    def values(self, parameters, views):
        """Return the values (...) of normalized views."""
        inputs = self._by_leg(views) * networks.equalizing_scale(self.views.sizes)
        leg_values = _leg_outputs(parameters, inputs, np.ones(self.legs, bool))
        return networks.body_outputs(leg_values, legs=True)[..., 0]

    def moment_vectors(self, views):
        """Return the vectors (..., legs, inputs) whose moments normalize views."""
        return self._by_leg(views)

    def normalize(self, moments: Moments) -> Normalizer:
        """Return the normalizer of views, the same for every leg."""
        mean, factor, limit = moments.normalizer()
        return Normalizer(self._repeat_for_legs(mean), self._repeat_for_legs(factor), limit)

    def export_actions(self, parameters, x):
        """Write the nodes of the actions (1, joints) for a normalized view (1, own)."""
        inputs = x.reshape(1, self.legs, self.features)
        (feature_layer,), head = parameters
        scaled_layer = {**feature_layer, "weight": feature_layer["weight"] * self.scale[:, None]}
        return self.body_actions(_trace_outputs(((scaled_layer,), head), inputs, _trace_full_mask(inputs)))

    def import_actions(self, weights):
        """Return the parameters from the weights and biases of the nodes that `export_actions` wrote, in order."""
        (scaled_layer,), head = _parameters_of_nodes(weights)
        feature_layer = {**scaled_layer, "weight": scaled_layer["weight"] / self.scale[:, None]}
        return (feature_layer,), head

    def body_actions(self, outputs):
        """Return the actions (..., joints) of the body for the outputs of its legs (..., legs, joints of a leg)."""
        return outputs.reshape(*outputs.shape[:-2], -1)[..., self.views.joints] * self.views.signs

    def leg_actions(self, actions: np.ndarray) -> np.ndarray:
        """Return the outputs of legs for actions (..., joints) of the body.

        Returns:
            (..., legs, joints of a leg), 0 where a leg has no such joint.
        """
        outputs = np.zeros((*actions.shape[:-1], self.legs * self.views.most), actions.dtype)
        outputs[..., self.views.joints] = actions * self.views.signs
        return outputs.reshape(*actions.shape[:-1], self.legs, -1)

    @functools.cached_property
    def scale(self) -> np.ndarray:
        """(features,) factors of normalized features; see `networks.equalizing_scale`."""
        return networks.equalizing_scale(self.views.sizes[: 1 + self.blocks])

    @functools.cached_property
    def _flat_views(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Sources, factors and bias in the order of a view, kept as every step needs them."""
        return self._flatten(self.views.sources), self._flatten(self.views.factors), self._flatten(self.views.bias)

    def _repeat_for_legs(self, vector):
        """Return a vector (inputs,) of a leg as that of a view, the same for every leg."""
        xp = vector.__array_namespace__()
        return self._flatten(xp.tile(vector, (self.legs, 1)))

    def _flatten(self, array):
        """Return an array (..., legs, inputs) in the order of a view, (..., legs * inputs)."""
        xp = array.__array_namespace__()
        lead_shape = array.shape[:-2]
        features = array[..., : self.features].reshape(*lead_shape, -1)
        privileged = array[..., self.features :].reshape(*lead_shape, -1)
        return xp.concatenate([features, privileged], axis=-1)

    def _by_leg(self, views):
        """Return what each leg sees (..., legs, features or inputs), the inverse of `_flatten`."""
        xp = views.__array_namespace__()
        lead_shape = views.shape[:-1]
        parts = [views[..., : self.action_inputs].reshape(*lead_shape, self.legs, -1)]
        if views.shape[-1] > self.action_inputs:
            parts.append(views[..., self.action_inputs :].reshape(*lead_shape, self.legs, -1))
        return xp.concatenate(parts, axis=-1)


class AnyLegs(NamedTuple):
    """Networks of the legs of any body, which see a leg, with torso, command and description, as tokens.

    Observations are those of a flat `BodiesEnv`; see `arc_suite.bodies.tokens`. They have room for more legs and joints
    than most bodies have.

    Attributes:
        inputs: numbers that a leg sees; the size of the moments that normalize them.
        size: numbers of an observation.
        joints: numbers of an action.
    """

    inputs: int = tokens.LEG_INPUT_SIZE
    size: int = sum(tokens.FLAT_SIZES.values())
    joints: int = MAX_LEGS * MAX_JOINTS

    symmetric = False

    @property
    def action_inputs(self) -> int:
        """Numbers of an observation that actions depend on: all."""
        return self.size

    def view(self, observations):
        """Return observations."""
        return observations

    def draw_policy(self, random, hidden, last_gain=1.0):
        """Draw the parameters of a network of actions."""
        return _draw_parameters(random, (self.inputs, hidden, hidden), MAX_JOINTS, last_gain)

    def draw_values(self, random, hidden):
        """Draw the parameters of a network of values."""
        return _draw_parameters(random, (self.inputs, hidden, hidden), 1)

    def actions(self, parameters, observations):
        """Return the actions (..., 48), 0 where there is no joint."""
        inputs, joint_mask = tokens.leg_inputs(observations)
        outputs = _leg_outputs(parameters, inputs, joint_mask.any(axis=-1))
        outputs = jnp.where(joint_mask, outputs, 0.0)
        return outputs.reshape(*outputs.shape[:-2], -1)

    def values(self, parameters, observations):
        """Return the values (...)."""
        inputs, joint_mask = tokens.leg_inputs(observations)
        leg_mask = joint_mask.any(axis=-1)
        leg_values = _leg_outputs(parameters, inputs, leg_mask)[..., 0]
        return jnp.where(leg_mask, leg_values, 0.0).sum(axis=-1) / leg_mask.sum(axis=-1)

    def moment_vectors(self, observations):
        """Return the inputs (n, 98) of all legs that bodies have."""
        inputs, joint_mask = tokens.leg_inputs(observations)
        return inputs[joint_mask.any(axis=-1)]

    def normalize(self, moments: Moments) -> Normalizer:
        """Return the normalizer of 759 numbers, the same for every leg; it does not change the number of joints.

        Inputs that never changed, as the ground in `steer`, are 0: in other tasks they have no effect.
        """
        xp = moments.mean.__array_namespace__()
        mean, factor, limit = moments.normalizer()
        is_constant = (moments.count > 0.0) & (moments.squares == 0.0)
        factor = xp.where(is_constant, xp.zeros_like(factor), factor)
        return Normalizer(tokens.repeat_for_legs(mean, 0.0), tokens.repeat_for_legs(factor, 1.0), limit)

    def export_actions(self, parameters, x):
        """Write the nodes of a network of actions, which compute the legs that the body has."""
        inputs, joint_mask = tokens.leg_inputs(x)
        leg_mask = joint_mask.sum(axis=-1) > 0.0
        outputs = _trace_outputs(parameters, inputs, leg_mask) * joint_mask
        return outputs.reshape(1, -1)

    def import_actions(self, weights):
        """Return the parameters from the weights and biases of the nodes that `export_actions` wrote, in order."""
        return _parameters_of_nodes(weights)


def _draw_parameters(random, sizes: tuple[int, ...], outputs: int, last_gain: float = 1.0):
    """Draw the parameters of networks that legs share.

    Args:
        random: generator to draw from.
        sizes: sizes of a leg's input and of the layers of features.
        outputs: numbers of a leg's output.
        last_gain: gain of the weights of the outputs.

    Returns:
        The layers of features, and the layers of the head.
    """
    features = sizes[-1]
    feature_layers = networks.mlp(random, sizes, "orthogonal", gain=_GAIN, last_gain=_GAIN)
    head = networks.mlp(random, (2 * features, features, outputs), "orthogonal", gain=_GAIN, last_gain=last_gain)
    return feature_layers, head


def _leg_outputs(parameters, inputs, leg_mask):
    """Return the outputs (..., legs, outputs) of networks that legs share.

    Args:
        parameters: layers of features, and layers of the head.
        inputs: (..., legs, inputs)
        leg_mask: (..., legs) booleans, which legs the body has.
    """
    feature_layers, head = parameters
    features = networks.apply_hidden_layers(feature_layers, inputs, ACTIVATION)
    is_leg = leg_mask[..., None]
    mean = jnp.where(is_leg, features, 0.0).sum(axis=-2, keepdims=True) / is_leg.sum(axis=-2, keepdims=True)
    head_inputs = jnp.concatenate([features, jnp.broadcast_to(mean, features.shape)], axis=-1)
    return networks.forward(head, head_inputs, ACTIVATION)


# What follows writes nodes of policy graphs. `Pick` takes the numbers of the legs that a mask has, and `Place` puts the
# results back, with 0 for the others.


def trace_shared_layers(inputs, layers):
    """Write the nodes of layers that legs share; see `networks.share_between_legs`.

    Args:
        inputs: (1, legs, size)
        layers: the first of which averages half of its units over legs.
    """
    first_layer, *later_layers = layers
    leg_mask = _trace_full_mask(inputs)
    units = activate(linear(inputs.node("Pick", leg_mask), first_layer), first_layer).node("Place", leg_mask)
    legs = units.shape[1]
    half = units.shape[-1] // 2
    mean = units[:, :, half:].sum(axis=1) / np.float32(legs)
    units = np.concatenate([units[:, :, :half], _repeat_for_legs(mean, leg_mask)], axis=-1)
    return perceptron(units.node("Pick", leg_mask), later_layers).node("Place", leg_mask)


def _trace_outputs(parameters, inputs, leg_mask):
    """Write the nodes of the outputs (1, legs, outputs) for the inputs (1, legs, inputs) of legs.

    The first layer of the head is a sum: the product with the features of a leg, and that with their mean, the context,
    which is computed once for all legs.
    """
    feature_layers, (head_layer, last_layer) = parameters
    leg_weight, mean_weight = np.split(np.asarray(head_layer["weight"]), 2)
    features = perceptron(inputs.node("Pick", leg_mask), feature_layers, ACTIVATION).node("Elu")
    mean = features.node("Place", leg_mask).sum(axis=1) / leg_mask.sum(axis=1)[:, None]
    context = mean.node("Linear", mean_weight, head_layer["bias"])
    context = _repeat_for_legs(context, leg_mask).node("Pick", leg_mask)
    hidden = (features.node("Product", leg_weight) + context).node("Elu")
    return hidden.node("Linear", last_layer["weight"], last_layer["bias"]).node("Place", leg_mask)


def _parameters_of_nodes(weights):
    """Return the parameters from the weights and biases of the nodes that `_trace_outputs` wrote, in order."""
    *feature_arrays, mean_weight, head_bias, leg_weight, last_weight, last_bias = weights
    feature_layers = tuple(map(networks.make_linear_layer, feature_arrays[::2], feature_arrays[1::2]))
    head_layer = networks.make_linear_layer(np.concatenate([leg_weight, mean_weight]), head_bias)
    last_layer = networks.make_linear_layer(last_weight, last_bias)
    return feature_layers, (head_layer, last_layer)


def _repeat_for_legs(x, leg_mask):
    """Return numbers (1, size) of the body for each of its legs, (1, legs, size)."""
    legs = leg_mask.shape[1]
    return np.broadcast_to(x[:, None], (1, legs, x.shape[-1]))


def _trace_full_mask(inputs):
    """Write a mask (1, legs) of 1, as the body has all legs of the inputs (1, legs, size)."""
    return inputs[:, :, 0] >= _LOWEST_INPUT
