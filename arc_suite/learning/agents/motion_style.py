"""Style on command: a share of the reward for moving as a motion does, whatever the task asks for.

A discriminator tells pairs of successive poses of the motion from those of the policy, as in adversarial motion priors
(Peng et al., 2021). A pose is the torso's height and tilt and the joint angles, without the torso's place, so that the
task decides where the body goes. The discriminator is part of a checkpoint and of no policy.
"""

import functools
import math
from typing import NamedTuple, Self

import jax
import jax.numpy as jnp
import numpy as np
import optax

from arc_suite import rotations
from arc_suite.learning.agents import networks
from arc_suite.models.standing import GRAVITY
from arc_suite.motions import check_body, motion_text
from arc_suite.tasks import Task
from arc_suite.tasks.modified_task import has_active
from arc_suite.tasks.modifiers import SensorsOnly
from arc_suite.tasks.motion_tables import MotionTables
from arc_suite.tasks.terms import greatest

_HIDDEN = (128, 64)  # units of the discriminator's layers
_RATE = 1e-4  # learning rate
_GRADIENT_PENALTY = 5.0  # on the square of the discriminator's gradient at poses of the motion
_WEIGHT_DECAY = 1e-4
_UPDATES = 3  # of the discriminator in an iteration
_PAIRS = 256  # of poses of each kind in an update
_MIN_SPREAD = 0.1  # of a number of a pose, to which it is scaled: what rests in the motion may move a little
_SUBSTEPS = 8  # of a control step, from which pairs of poses of the motion are taken


class StyleState(NamedTuple):
    """What an iteration changes.

    Attributes:
        layers: of the discriminator.
        moments: of its optimizer.
    """

    layers: tuple
    moments: optax.OptState


class MotionStyle(NamedTuple):
    """The motion whose style a policy learns.

    Attributes:
        share: of the style in the reward.
        highest_reward: the most that a step of the task gives, and a step in style, too.
        height: standing height of the body, m.
        mean: (2 * numbers,) of pairs of poses of the motion.
        scale: (2 * numbers,) standard deviations of these pairs.
        pairs: (pairs, 2 * numbers) pairs of poses of the motion, scaled.
    """

    share: float
    highest_reward: float
    height: float
    mean: np.ndarray
    scale: np.ndarray
    pairs: np.ndarray

    @classmethod
    def of(cls, task: Task, motion: str, share: float, both_sides: bool) -> Self:
        """Return the style of a motion for a task.

        Args:
            task: task of the body that the motion is of.
            motion: path of a motion's file, or a motion as text.
            share: of the style in the reward.
            both_sides: whether the mirror image of the motion is as good.

        Raises:
            ValueError: no motion, or one of another body, or observations without poses.
            OSError: the file cannot be read.
        """
        if "posture" not in task.sizes:
            reason = "as poses are read from it; see exclude_blocks"
            raise ValueError(f"style: expected the block posture, {reason}, got {', '.join(task.sizes)}")
        body = task.scene.body
        body_motion = motion_text.read(motion)
        check_body(body_motion, body)
        height = body.torso.standing_height
        timestep = task.scene.control_timestep / _SUBSTEPS
        tables = MotionTables.of(body, [body_motion], timestep, math.sqrt(GRAVITY / height))
        # In place of the height, which no sensor gives, observations have 0.
        heights = np.zeros_like(tables.heights) if has_active(task, SensorsOnly) else tables.heights
        poses = _describe(heights, tables.quaternions, tables.angles, height)
        starts = [0, tables.mirror_offset] if both_sides and tables.mirror_offset else [0]
        cycles = [poses[start : start + tables.counts[0]] for start in starts]
        pairs = np.concatenate([pair_poses(cycle, np.roll(cycle, -_SUBSTEPS, axis=0)) for cycle in cycles])
        mean = pairs.mean(axis=0)
        scale = pairs.std(axis=0).clip(_MIN_SPREAD)
        scaled_pairs = ((pairs - mean) / scale).astype(np.float32)
        return cls(share, greatest(task.settings.weights), height, mean, scale, scaled_pairs)

    def poses(self, task: Task, observations: np.ndarray) -> np.ndarray:
        """Return what the discriminator sees of the poses (..., numbers) in observations (..., size) of the task."""
        posture = task.split(observations)["posture"].astype(float)
        return _describe(posture[..., 0], posture[..., 1:5], posture[..., 5:], self.height)

    def begin(self, random: np.random.Generator) -> StyleState:
        """Return a discriminator that has learned nothing."""
        layers = networks.mlp(random, (self.pairs.shape[-1], *_HIDDEN, 1))
        layers = jax.tree.map(jnp.asarray, layers)
        return StyleState(layers, optax.adam(_RATE).init(layers))

    def add_reward(self, state: StyleState, rewards: np.ndarray, pairs: np.ndarray) -> tuple[np.ndarray, float]:
        """Return rewards (...) with the share of the style, and the mean of the style, about 0 to 1.

        Args:
            state: the discriminator.
            rewards: (...) of the task.
            pairs: (..., 2 * numbers) poses before and after each step.
        """
        scores = np.asarray(_score(state.layers, self._scale(pairs)))
        styles = (0.5 * (scores + 1.0)).clip(-1.0, 1.0)  # a clear difference must not hide which way is nearer
        style_rewards = self.highest_reward * styles
        return (1.0 - self.share) * rewards + self.share * style_rewards, float(styles.mean())

    def learn(self, state: StyleState, pairs: np.ndarray, random: np.random.Generator) -> StyleState:
        """Return the discriminator after an iteration, given pairs of poses of the policy and a source of draws."""
        policy_pairs = self._scale(pairs.reshape(-1, pairs.shape[-1]))
        return _learn(state, _draw_pairs(self.pairs, random), _draw_pairs(policy_pairs, random))

    def _scale(self, pairs: np.ndarray) -> np.ndarray:
        return ((pairs - self.mean) / self.scale).astype(np.float32)


def pair_poses(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Return pairs (..., 2 * numbers) of poses (..., numbers) before and after a step."""
    return np.concatenate([before, after], axis=-1)


def _describe(heights, quaternions, angles, height: float) -> np.ndarray:
    """Return numbers (..., 4 + joints) of poses: height by h, the vertical in the torso's frame, angles."""
    vertical = rotations.matrix(quaternions)[..., 2, :]
    return np.concatenate([heights[..., None] / height, vertical, angles], axis=-1)


def _draw_pairs(pairs: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Draw the pairs (updates, pairs, numbers) of the updates of an iteration."""
    return pairs[random.integers(len(pairs), size=(_UPDATES, _PAIRS))]


@jax.jit
def _score(layers, pairs):
    """Return scores (...) of pairs of poses: near 1 for those of the motion, near -1 for those of the policy."""
    return networks.forward(layers, pairs)[..., 0]


@jax.jit
def _learn(state: StyleState, motion_pairs, policy_pairs) -> StyleState:
    """Return the state after updates with pairs (updates, pairs, numbers) of both kinds."""

    def loss(layers, of_motion, of_policy):
        score = functools.partial(_score, layers)
        gradients = jax.vmap(jax.grad(score))(of_motion)
        penalty = (gradients * gradients).sum(axis=-1).mean()
        squares = sum((layer["weight"] ** 2).sum() for layer in layers)
        errors = ((score(of_motion) - 1.0) ** 2).mean() + ((score(of_policy) + 1.0) ** 2).mean()
        return errors + _GRADIENT_PENALTY * penalty + _WEIGHT_DECAY * squares

    def update(current: StyleState, pairs):
        gradient = jax.grad(loss)(current.layers, *pairs)
        change, moments = optax.adam(_RATE).update(gradient, current.moments)
        return StyleState(optax.apply_updates(current.layers, change), moments), None

    state, _ = jax.lax.scan(update, state, (motion_pairs, policy_pairs))
    return state


def arrays(state: StyleState | None) -> dict[str, np.ndarray]:
    """Return the arrays of a checkpoint by name."""
    return jax.tree.map(np.asarray, networks.name_leaves({"style": state}))
