"""Tasks as functions of JAX, on MuJoCo's MJX: thousands of worlds on a GPU, in the style of Brax and Playground.

    env = mjx.load("queen", "walk")
    state = jax.jit(jax.vmap(env.reset))(jax.random.split(jax.random.key(0), 4096))
    state = jax.jit(jax.vmap(env.step))(state, actions)     # state.data .obs .reward .done .metrics .info

Functions take one world and are pure. The wrappers and trainers of MuJoCo Playground take an `Env` as it is.
Needs the extra `gpu`; docs/gpu.md tells more.
"""

import dataclasses
import os
import types
from collections.abc import Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from arc_suite import checks
from arc_suite.envs.prepare import prepare_task
from arc_suite.learning.worlds import device, starts
from arc_suite.robots.spec import Body
from arc_suite.simulation import pictures
from arc_suite.tasks import privileged as seen
from arc_suite.tasks import terms
from arc_suite.tasks.contract import Inputs

_MOST_ENVS = 1 << 20
# Fields of the simulation that a start sets; all others follow from them in a step.
START_FIELDS = ("time", "qpos", "qvel", "qacc_warmstart", "mocap_pos")


@jax.tree_util.register_dataclass
@dataclasses.dataclass
class WorldState:
    """The state of a world, or with leading axes of many.

    Attributes:
        data: of the simulation, an `mjx.Data`.
        obs: (..., size) float32.
        reward: (...) of the latest step.
        done: (...) 1.0 where the episode is over, else 0.0.
        metrics: of the latest step: the task's unweighted terms as `reward_<term>`; `diverged` and `overflow`, 0 or 1.
        info: `memory` of the task and `first_memory` of the episode's start; `model`, the fields of the model that
            are the episode's own; `privileged`, the privileged observation (size,), where it was asked for;
            `truncation`, 1.0 where the task ended the episode without failure; and each live command of the task by its
            name, NaN for what the task itself would do.
    """

    data: Any
    obs: jax.Array
    reward: jax.Array
    done: jax.Array
    metrics: dict[str, jax.Array]
    info: dict[str, Any]

    replace = dataclasses.replace


def load(
    domain_name: str | os.PathLike | Body,
    task_name: str,
    task_kwargs: Mapping[str, Any] | None = None,
    impl: str | None = None,
    num_starts: int = 4096,
    first_seed: int = 0,
    num_envs: int = 1,
    privileged: bool = False,
) -> "Env":
    """Load a task as functions of JAX.

    Args:
        domain_name: a robot or another body; see `arc_suite.load`.
        task_name: as in `arc_suite.load`.
        task_kwargs: as in `arc_suite.load`, without `random`.
        impl: "jax" or "warp"; None for warp on NVIDIA's GPUs where it is installed, else jax.
        num_starts: episodes in the table of starts, at most 16,384.
        first_seed: seed of the first of them; the others count on.
        num_envs: worlds that will step together. Warp's tables have place for so many.
        privileged: whether infos hold the privileged observation; see `tasks.privileged`.

    Raises:
        ValueError: an unknown name, a value that does not fit, or a task that the implementation cannot simulate.
        MissingExtra: a package is not installed.
    """
    return Env(domain_name, task_name, task_kwargs, impl, num_starts, first_seed, num_envs, privileged)


class Env:
    """A task; see `load`.

    Attributes:
        task: the task, a value of the contract.
        impl: the implementation, "jax" or "warp".
        num_starts: episodes in the table of starts.
        first_seed: seed of the first of them.
        num_envs: worlds that Warp's tables have place for.
        episode_length: control steps of an episode, may be infinite. `step` does not count them: give the number to
            the wrapper that ends episodes.
        action_size: numbers of an action.
        observation_size: numbers of an observation.
        dt: s between two actions.
        sim_dt: s of a substep.
        n_substeps: of a control step.
        mj_model: the model as compiled.
    """

    def __init__(self, domain_name, task_name, task_kwargs, impl, num_starts, first_seed, num_envs, privileged):
        """Draw the starts and put the model on the device; see `load`."""
        if "random" in checks.mapping("task_kwargs", task_kwargs):
            raise ValueError("random: expected none, as `reset` takes a key, and `start` a seed")
        self.impl, self.num_envs = (
            device.choose_implementation(impl),
            checks.integer("num_envs", num_envs, 1, _MOST_ENVS),
        )
        self.num_starts, self.first_seed = num_starts, checks.seed(first_seed)
        self._starts = starts.draw_starts(domain_name, task_name, task_kwargs, num_starts, first_seed, privileged)
        settings = {name: value for name, value in (task_kwargs or {}).items() if name != "on_divergence"}
        self.task, self.mj_model = prepare_task(domain_name, task_name, settings)
        if self.task.adapts:
            why = "as its starts depend on the episode before"
            raise ValueError(f"task {self.task.name}: expected no curriculum, {why}")
        model = device.adapt_model(self.mj_model, self.impl)
        self._mjx_model = self._compiled = device.put_model(model, self.impl)
        self._data = device.make_data(model, self.impl, self.num_envs)
        self.episode_length = self.task.step_limit
        self.observation_size, self.action_size = self.task.size, len(self.task.scene.body.joint_names)
        scene = self.task.scene
        self.dt, self.sim_dt, self.n_substeps = scene.control_timestep, self.mj_model.opt.timestep, scene.substeps

    @property
    def mjx_model(self):
        """The model on the device."""
        return self._mjx_model

    @property
    def unwrapped(self) -> "Env":
        """Itself, as it is no wrapper."""
        return self

    def reset(self, rng) -> WorldState:
        """Return the start of an episode, one of the table, given a key of JAX."""
        return self.start(np.uint32(self.first_seed) + jax.random.randint(rng, (), 0, self.num_starts).astype("uint32"))

    def start(self, seed) -> WorldState:
        """Return the start of the episode that any environment of the suite has after `reset(seed=seed)`.

        Args:
            seed: () an integer from `first_seed` on; episodes repeat after `num_starts`.
        """
        index = (jnp.asarray(seed).astype("uint32") - np.uint32(self.first_seed)) % np.uint32(self.num_starts)
        start = jax.tree.map(lambda table: jnp.asarray(table)[index], self._starts)
        data = self._data.replace(qpos=start.qpos, qvel=start.qvel, mocap_pos=start.mocap_pos)
        zero = jnp.zeros(())
        info = {name: jnp.full(size, jnp.nan) for name, size in self.task.commands.items()}
        info |= {"memory": start.memory, "first_memory": start.memory, "model": start.model, "truncation": zero}
        if start.privileged is not None:
            info["privileged"] = self._seen(start.model, seen.split(seen.sizes(self.task), start.privileged))
        names = (*(f"reward_{name}" for name in self.task.settings.weights), "diverged", "overflow")
        return WorldState(data, start.observation, zero, zero, dict.fromkeys(names, zero), info)

    def step(self, state: WorldState, action) -> WorldState:
        """Return the state after a control step.

        A world that diverges is done, with reward 0, and goes on from the model's default state, as in MuJoCo.

        Args:
            state: before.
            action: (motors,), clipped to [-1, 1].
        """
        # Products in single precision, where the default of recent GPUs is less.
        with jax.default_matmul_precision("highest"):
            return self._step(state, jnp.clip(action, -1.0, 1.0))

    def render(
        self,
        trajectory,
        height: int = 240,
        width: int = 320,
        camera: int | str | None = None,
        scene_option=None,
        modify_scene_fns=None,
        index: int | None = None,
    ) -> list[np.ndarray]:
        """Return pictures (height, width, 3) uint8, drawn on the host.

        Args:
            trajectory: a state or several.
            height: pixels.
            width: pixels.
            camera: name or index of a camera; None for the one that tracks the body.
            scene_option: None; wrappers hand it on.
            modify_scene_fns: None; wrappers hand it on.
            index: of a world in states of many; None for states of one.

        Raises:
            ValueError: no such camera, an impossible size, or options of a scene.
            RenderingUnavailable: no OpenGL here.
        """
        if scene_option is not None or modify_scene_fns is not None:
            raise ValueError(
                "render: expected neither scene_option nor modify_scene_fns; see arc_suite.learning.worlds.mjx"
            )
        states = [trajectory] if isinstance(trajectory, WorldState) else trajectory
        camera = "tracking" if camera is None else camera
        return [self._picture(state, index, height=height, width=width, camera_id=camera) for state in states]

    def _picture(self, state: WorldState, index: int | None, **options) -> np.ndarray:
        scene, fields = self.task.scene, device.select_fields(state.data, ("mocap_pos", *self.task.reads))
        alone = jax.tree.map(lambda leaf: np.asarray(leaf)[() if index is None else index], vars(fields))
        memory = jax.tree.map(lambda leaf: np.asarray(leaf)[() if index is None else index], state.info["memory"])
        markers = self.task.markers(memory, self.task.read(types.SimpleNamespace(**alone)))
        pose = {"qpos": alone["qpos"], "mocap_pos": alone["mocap_pos"], "markers": markers}
        return pictures.picture(scene.body, scene.arena, **pose, failed_legs=self.task.failed_legs(memory), **options)

    def _seen(self, model, blocks):
        """The privileged observation (size,), given fields of the episode's model, and its blocks.

        Fields that wrappers have changed for good hold in place of what was drawn.
        """
        names = [name for name in self.task.read_back_fields if name not in model]
        pairs = {name: (getattr(self._mjx_model, name), getattr(self._compiled, name)) for name in names}
        changed = {name: new for name, (new, old) in pairs.items() if new is not old}
        return seen.vector(self.task, {**blocks, **self.task.read_back(blocks, changed)}, jnp.float32)

    def _step(self, state: WorldState, action) -> WorldState:
        task, info, before = self.task, state.info, state.data
        # Wrappers may put the data of the start in place, and leave the memory.
        begins = before.time == 0.0
        memory = jax.tree.map(lambda first, now: jnp.where(begins, first, now), info["first_memory"], info["memory"])
        for name in task.commands:
            memory = task.with_command(memory, name, info[name])
        moved, inputs = task.before(memory, action)
        data = _written(before, inputs, task.scene.layout.torso)
        data = device.advance(self._mjx_model.replace(**info["model"]), data, self.n_substeps)
        diverged, overflow = device.has_diverged(data), device.has_overflow(data)

        fields = device.select_fields(data, task.reads)
        readings = task.read(fields)
        after = task.after(moved, readings)
        found, reward = terms.reward(task.terms(after, readings), task.settings.weights, task.cost_limit)
        observation = task.vector(task.observe(after, readings), jnp.float32)
        terminated, truncated = task.ended(after, readings)

        # Sums of substeps round; the time after k control steps is k dt.
        data = data.replace(time=(jnp.round(before.time / self.dt) + 1.0) * self.dt)
        blank = self._data
        data = data.replace(
            qpos=jnp.where(diverged, blank.qpos, data.qpos),
            qvel=jnp.where(diverged, blank.qvel, data.qvel),
            qacc_warmstart=jnp.where(diverged, blank.qacc_warmstart, data.qacc_warmstart),
        )
        after = jax.tree.map(lambda new, old: jnp.where(diverged, old, new).astype(old.dtype), after, memory)
        metrics = {f"reward_{name}": jnp.where(diverged, 0.0, term) for name, term in found.items()}
        metrics |= {"diverged": diverged, "overflow": overflow}
        told = {"memory": after, "truncation": _float(truncated & ~(terminated | diverged))}
        if "privileged" in info:
            told["privileged"] = jnp.where(diverged, 0.0, self._seen(info["model"], task.privileged(after, fields)))
        return WorldState(
            data=data,
            obs=jnp.where(diverged, 0.0, observation),
            reward=_float(jnp.where(diverged, 0.0, reward)),
            done=_float(terminated | truncated | diverged),
            metrics=state.metrics | {name: _float(metric) for name, metric in metrics.items()},  # and those of wrappers
            info={**info, **told},
        )


def _written(data, inputs: Inputs, torso: int):
    """Return the data of a simulation with what a control step writes, given the torso's place among the bodies."""
    data = data.replace(ctrl=data.ctrl.at[: inputs.ctrl.shape[-1]].set(inputs.ctrl))
    if inputs.kick is not None:
        data = data.replace(qvel=data.qvel + inputs.kick)
    if inputs.force is not None:
        data = data.replace(xfrc_applied=data.xfrc_applied.at[torso, :3].set(inputs.force))
    return data


def restart_where_ended(state: WorldState, start: WorldState, ended) -> WorldState:
    """Return the state of a world whose next step is the first of another episode, where one has ended.

    Args:
        state: after a step.
        start: of the other episode.
        ended: () whether it begins.
    """

    def chosen(new, old):
        return jax.tree.map(lambda new, old: jnp.where(ended, new, old), new, old)

    written = {name: chosen(getattr(start.data, name), getattr(state.data, name)) for name in START_FIELDS}
    data, info = state.data.replace(**written), chosen(start.info, state.info)
    return state.replace(data=data, obs=chosen(start.obs, state.obs), info=info)


def _float(value):
    return jnp.asarray(value).astype(float)
