"""Architectures whose networks all legs share; see `architectures`.

A first network maps what a leg sees to features. A second one maps the features of a leg, and their mean over all legs,
to actions of its joints. Values are means over legs.
"""

import dataclasses
import functools
from collections.abc import Iterable
from typing import NamedTuple, Self

import jax.numpy as jnp
import numpy as np

from arc_suite.bodies import tokens
from arc_suite.bodies.tokens import JOINTS, LEGS
from arc_suite.learning.agents import critic_blocks as behind
from arc_suite.learning.agents import networks
from arc_suite.learning.agents.networks import ACTIVATION
from arc_suite.learning.agents.normalizer import Moments, Normalizer
from arc_suite.policies.tracing import activated, linear, perceptron
from arc_suite.tasks import Task
from arc_suite.tasks.leg_views import LegViews, leg_views

_LEAST = -1e4  # less than any feature, and finite in policies of 16 bits


@dataclasses.dataclass(frozen=True, eq=False)
class Legs:
    """Networks of the legs of one body, which see an observation as `arc_suite.tasks.leg_views` has it.

    What is learned with one leg holds for all: commands to the side, backward and to turn follow from those forward.

    Attributes:
        views: of the legs.
        size: of an observation.
        blocks: how many it has; blocks of the views after them are privileged.
        symmetric: whether the networks treat left and right alike, whatever their parameters.
    """

    views: LegViews
    size: int
    blocks: int
    symmetric: bool

    legs = property(lambda self: len(self.views.bias))
    joints = property(lambda self: len(self.views.joints))
    features = property(lambda self: sum(self.views.sizes[: 1 + self.blocks]))
    own = property(lambda self: self.legs * self.features)
    inputs = property(lambda self: sum(self.views.sizes))

    @classmethod
    def of(cls, task: Task, critic_blocks: Iterable[str] = (), symmetric: bool = True) -> Self:
        """Return the architecture for a task.

        Args:
            task: whose observations they are.
            critic_blocks: names of privileged blocks for networks of values.
            symmetric: whether to treat left and right alike, if the task is symmetric.
        """
        symmetry = behind.mirror_maps(task, critic_blocks) if symmetric else None
        privileged = {f"privileged {name}": task.privileged_blocks[name] for name in critic_blocks}
        views = leg_views(task.scene.body, {**task.blocks, **privileged}, symmetry)
        return cls(views, task.size, len(task.sizes), symmetry is not None)

    def viewed(self, observations):
        """Return what legs see of observations (..., size), privileged blocks after them if there are any."""
        seen = slice(self.own if observations.shape[-1] == self.size else None)
        sources, factors, bias = (values[..., seen] for values in self._flat_views)
        return sum((observations[..., sources[i]] * factors[i] for i in range(2)), bias)

    def drawn(self, random, hidden, last_gain=1.0):
        """Draw the parameters of a network of actions."""
        return _drawn(random, (self.features, hidden), self.views.most, last_gain)

    def drawn_values(self, random, hidden):
        """Draw the parameters of a network of values."""
        return _drawn(random, (self.inputs, hidden), 1)

    def actions(self, parameters, views):
        """Return the actions (..., joints) for normalized views (..., own or more)."""
        legs = self._by_leg(views)[..., : self.features] * self.scale
        return self.body_actions(_of_legs(parameters, legs, np.ones(self.legs, bool)))

    def values(self, parameters, views):
        """Return the values (...) of normalized views."""
        legs = self._by_leg(views) * networks.equalizing_scale(self.views.sizes)
        return networks.body_outputs(_of_legs(parameters, legs, np.ones(self.legs, bool)), legs=True)[..., 0]

    def seen(self, views):
        """Return the vectors (..., legs, inputs) whose moments normalize views."""
        return self._by_leg(views)

    def normalize(self, moments: Moments) -> Normalizer:
        """Return what normalizes views, the same for every leg."""
        mean, factor, limit = moments.normalizer()
        mean, factor = (self._flat(np.tile(values, (self.legs, 1))) for values in (mean, factor))
        return Normalizer(mean, factor, limit)

    def exported(self, parameters, x):
        """Write the nodes of the actions (1, joints) for a normalized view (1, own)."""
        legs = x.reshape(1, self.legs, self.features)
        (first,), head = parameters
        first = {**first, "weight": first["weight"] * self.scale[:, None]}
        return self.body_actions(_exported(((first,), head), legs, _there(legs)))

    def imported(self, weights):
        """Return the parameters from the weights and biases of the nodes that `exported` wrote, in order."""
        (first,), head = _imported(weights)
        return ({**first, "weight": first["weight"] / self.scale[:, None]},), head

    def body_actions(self, legs):
        """Return the actions (..., joints) of the body that are what its legs do (..., legs, joints of a leg)."""
        return legs.reshape(*legs.shape[:-2], -1)[..., self.views.joints] * self.views.signs

    def leg_actions(self, actions: np.ndarray) -> np.ndarray:
        """Return what legs do (..., legs, joints of a leg), 0 for no joint, from actions (..., joints) of the body."""
        legs = np.zeros((*actions.shape[:-1], self.legs * self.views.most), actions.dtype)
        legs[..., self.views.joints] = actions * self.views.signs
        return legs.reshape(*actions.shape[:-1], self.legs, -1)

    @functools.cached_property
    def scale(self) -> np.ndarray:
        """(features,) factors of normalized features; see `networks.equalizing_scale`."""
        return networks.equalizing_scale(self.views.sizes[: 1 + self.blocks])

    @functools.cached_property
    def _flat_views(self) -> list[np.ndarray]:
        """Sources, factors and bias in the order of a view, which is asked for in every step."""
        return [self._flat(values) for values in (self.views.sources, self.views.factors, self.views.bias)]

    def _flat(self, values: np.ndarray) -> np.ndarray:
        """Values (..., legs, inputs) in the order of a view: those of all legs that actions depend on come first."""
        parts = values[..., : self.features], values[..., self.features :]
        return np.concatenate([part.reshape(*values.shape[:-2], -1) for part in parts], axis=-1)

    def _by_leg(self, views):
        """What each leg sees (..., legs, features or inputs)."""
        parts = views[..., : self.own], views[..., self.own :]
        parts = [part.reshape(*views.shape[:-1], self.legs, -1) for part in parts if part.shape[-1]]
        return views.__array_namespace__().concatenate(parts, axis=-1)


class AnyLegs(NamedTuple):
    """Networks of the legs of any body, which see a leg, with torso, command and description, as tokens.

    Observations are those of a flat `BodiesEnv`; see `arc_suite.bodies.tokens`.
    """

    inputs: int = tokens.LEG_INPUTS
    size: int = sum(tokens.FLAT.values())
    joints: int = LEGS * JOINTS

    symmetric = False
    own = property(lambda self: self.size)

    def viewed(self, observations):
        """Return observations."""
        return observations

    def drawn(self, random, hidden, last_gain=1.0):
        """Draw the parameters of a network of actions."""
        return _drawn(random, (self.inputs, hidden, hidden), JOINTS, last_gain)

    def drawn_values(self, random, hidden):
        """Draw the parameters of a network of values."""
        return _drawn(random, (self.inputs, hidden, hidden), 1)

    def actions(self, parameters, observations):
        """Return the actions (..., 48), 0 where there is no joint."""
        legs, mask = tokens.leg_inputs(observations)
        found = jnp.where(mask, _of_legs(parameters, legs, mask.any(axis=-1)), 0.0)
        return found.reshape(*found.shape[:-2], -1)

    def values(self, parameters, observations):
        """Return the values (...)."""
        legs, mask = tokens.leg_inputs(observations)
        there = mask.any(axis=-1)
        found = _of_legs(parameters, legs, there)
        return jnp.where(there, found[..., 0], 0.0).sum(axis=-1) / there.sum(axis=-1)

    def seen(self, observations):
        """Return the inputs (n, 81) of all legs that there are."""
        legs, mask = tokens.leg_inputs(observations)
        return legs[mask.any(axis=-1)]

    def normalize(self, moments: Moments) -> Normalizer:
        """Return what normalizes 664 numbers, the same for every leg; it leaves the number of joints as it is."""
        mean, factor, limit = moments.normalizer()
        return Normalizer(tokens.of_all_legs(mean, 0.0), tokens.of_all_legs(factor, 1.0), limit)

    def exported(self, parameters, x):
        """Write the nodes of a network of actions, which compute the legs that there are."""
        legs, mask = tokens.leg_inputs(x)
        return (_exported(parameters, legs, mask.sum(axis=-1) > 0.0) * mask).reshape(1, -1)

    def imported(self, weights):
        """Return the parameters."""
        return _imported(weights)


def _drawn(random, sizes: tuple[int, ...], outputs: int, last_gain: float = 1.0):
    """Draw the parameters: layers of features, of these sizes, and those of the outputs."""
    gain, hidden = 2**0.5, sizes[-1]
    features = networks.mlp(random, sizes, "orthogonal", gain=gain, last_gain=gain)
    return features, networks.mlp(random, (2 * hidden, hidden, outputs), "orthogonal", gain=gain, last_gain=last_gain)


def _of_legs(parameters, legs, there):
    """Return the outputs (..., legs, outputs) for what legs see (..., legs, features), given which there are."""
    features, head = parameters
    found, there = networks.apply_hidden_layers(features, legs, ACTIVATION), there[..., None]
    mean = jnp.where(there, found, 0.0).sum(axis=-2, keepdims=True) / there.sum(axis=-2, keepdims=True)
    both = jnp.concatenate([found, jnp.broadcast_to(mean, found.shape)], axis=-1)
    return networks.forward(head, both, ACTIVATION)


def trace_shared_layers(legs, layers):
    """Write the nodes of layers that legs share, for views (1, legs, size); see `networks.share_between_legs`."""
    first, *others = layers
    there = _there(legs)
    found = activated(linear(legs.node("Pick", there), first), first).node("Place", there)
    half = found.shape[-1] // 2
    mean = _for_all(found[:, :, half:].sum(axis=1) / np.float32(found.shape[1]), there)
    found = np.concatenate([found[:, :, :half], mean], axis=-1)
    return perceptron(found.node("Pick", there), others).node("Place", there)


def _for_all(x, there):
    """Numbers (1, size) of the body for each of its legs (1, legs, size)."""
    return np.broadcast_to(x[:, None], (1, *there.shape[1:], x.shape[-1]))


def _there(legs):
    """Write a mask (1, legs) of 1, as all legs (1, legs, size) are there."""
    return legs[:, :, 0] >= _LEAST


def _exported(parameters, legs, there):
    """Write the nodes of the outputs (1, legs, outputs) for what legs see (1, legs, features)."""
    features, (head, last) = parameters
    own, mean = np.split(np.asarray(head["weight"]), 2)
    found = perceptron(legs.node("Pick", there), features, ACTIVATION).node("Elu")
    context = found.node("Place", there).sum(axis=1) / there.sum(axis=1)[:, None]
    context = _for_all(context.node("Linear", mean, head["bias"]), there).node("Pick", there)
    hidden = found.node("Product", own) + context
    return hidden.node("Elu").node("Linear", last["weight"], last["bias"]).node("Place", there)


def _imported(weights):
    """Return the parameters from the weights and biases of the nodes that `_exported` wrote, in order."""
    *features, mean, bias, own, last, last_bias = weights
    head = networks.make_linear_layer(np.concatenate([own, mean]), bias), networks.make_linear_layer(last, last_bias)
    return tuple(map(networks.make_linear_layer, features[::2], features[1::2])), head
