"""Tasks as functions of JAX, on MuJoCo's MJX: thousands of worlds on a GPU, in the style of Brax and Playground.

    env = mjx.load("queen", "walk")
    state = jax.jit(jax.vmap(env.reset))(jax.random.split(jax.random.key(0), 4096))
    state = jax.jit(jax.vmap(env.step))(state, actions)     # state.data .obs .reward .done .metrics .info

Functions take one world and are pure. The wrappers and trainers of MuJoCo Playground take an `Env` as it is.
They need the extra `gpu`; see docs/gpu.md.
"""

import copy
import dataclasses
import functools
import os
import types
from collections.abc import Mapping
from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np

from arc_suite import checks
from arc_suite.envs.prepare import prepare_task
from arc_suite.learning.worlds import device, starts
from arc_suite.robots.spec import Body
from arc_suite.simulation import pictures
from arc_suite.tasks import privileged as privileged_blocks
from arc_suite.tasks import terms
from arc_suite.tasks.contract import Inputs

_MAX_ENVS = 1 << 20

# Fields of the simulation that a start sets; all other fields follow from them in a step.
START_FIELDS = ("time", "qpos", "qvel", "qacc_warmstart", "mocap_pos")


@jax.tree_util.register_dataclass
@dataclasses.dataclass
class WorldState:
    """The state of a world, or of many worlds with leading axes.

    The metrics of the latest step are the task's unweighted terms as `reward_<term>`, and `diverged` and `overflow`,
    0 or 1. The info of a state has

    - `memory`: of the task, and `first_memory`: that of the episode's start;
    - `model`: the fields of the model that the episode has drawn;
    - `privileged`: the privileged observation (size,), if the environment was loaded with it;
    - `truncation`: 1.0 where the task ended the episode without failure, or the simulation diverged, otherwise 0.0;
    - each live command of the task by its name; NaN leaves the command to the task.

    Attributes:
        data: of the simulation, an `mjx.Data`.
        obs: (..., size) float32.
        reward: (...) reward of the latest step.
        done: (...) 1.0 where the episode is over, otherwise 0.0.
        metrics: metrics of the latest step, by name.
        info: info of the episode, by name.
    """

    data: Any
    obs: jax.Array
    reward: jax.Array
    done: jax.Array
    metrics: dict[str, jax.Array]
    info: dict[str, Any]

    replace = dataclasses.replace


def load(
    domain_name: str | os.PathLike[str] | Body,
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
        first_seed: seed of the first of these episodes; the others have the seeds after it.
        num_envs: worlds that will step together; Warp's tables have place for so many.
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
        first_seed: seed of the first of these episodes.
        num_envs: worlds that Warp's tables have place for.
        episode_length: control steps of an episode, may be infinite. `step` does not count them: give the number to
            the wrapper that ends episodes.
        action_size: numbers of an action.
        observation_size: numbers of an observation.
        dt: duration of a control step, s.
        sim_dt: duration of a substep, s.
        n_substeps: number of substeps of a control step.
        mj_model: the model as compiled.
    """

    def __init__(self, domain_name, task_name, task_kwargs, impl, num_starts, first_seed, num_envs, privileged):
        """Draw the starts and put the model on the device; see `load`."""
        if "random" in checks.mapping("task_kwargs", task_kwargs):
            raise ValueError("random: expected none, as `reset` takes a key, and `start` a seed")
        checks.boolean("privileged", privileged)
        self.impl = device.choose_implementation(impl)
        self.num_envs = checks.integer("num_envs", num_envs, 1, _MAX_ENVS)
        self.num_starts = num_starts
        self.first_seed = checks.seed(first_seed)
        self._draw = functools.partial(
            starts.draw_starts, domain_name, task_name, task_kwargs, num_starts, privileged=privileged
        )
        self._starts = self._draw(first_seed)
        settings = {name: value for name, value in (task_kwargs or {}).items() if name != "on_divergence"}
        self.task, self.mj_model = prepare_task(domain_name, task_name, settings)
        if self.task.adapts:
            reason = "as its starts depend on the episode before"
            raise ValueError(f"task {self.task.name}: expected no curriculum, {reason}")
        model = device.adapt_model(self.mj_model, self.impl)
        self._unchanged_model = device.put_model(model, self.impl)
        self._mjx_model = self._unchanged_model  # which wrappers may replace
        self._data = device.make_data(model, self.impl, self.num_envs)
        scene = self.task.scene
        self.episode_length = self.task.step_limit
        self.observation_size = self.task.size
        self.action_size = len(scene.body.joint_names)
        self.dt = scene.control_timestep
        self.sim_dt = self.mj_model.opt.timestep
        self.n_substeps = scene.substeps

    @property
    def mjx_model(self):
        """The model on the device."""
        return self._mjx_model

    @property
    def unwrapped(self) -> "Env":
        """Itself, as it is no wrapper."""
        return self

    def reset(self, rng) -> WorldState:
        """Return the start of an episode of the table, which a key of JAX draws."""
        return self.start_of(jax.random.randint(rng, (), 0, self.num_starts))

    def start(self, seed) -> WorldState:
        """Return the start of the episode that any environment of the suite has after `reset(seed=seed)`.

        Args:
            seed: () an integer from `first_seed` on; episodes repeat after `num_starts`.
        """
        return self.start_of(jnp.asarray(seed).astype("uint32") - np.uint32(self.first_seed))

    def draw_starts(self, first_seed: int) -> starts.Starts:
        """Return a table of starts: as many as this environment has, whose first one has another seed."""
        return self._starts if first_seed == self.first_seed else self._draw(first_seed)

    def with_starts(self, table: starts.Starts) -> Self:
        """Return this environment with another table of as many starts."""
        environment = copy.copy(self)
        environment._starts = table
        return environment

    def start_of(self, number) -> WorldState:
        """Return the start of an episode of the table by its number, (); episodes repeat after `num_starts`."""
        index = number.astype("uint32") % np.uint32(self.num_starts)
        start = jax.tree.map(lambda table: jnp.asarray(table)[index], self._starts)
        data = self._data.replace(qpos=start.qpos, qvel=start.qvel, mocap_pos=start.mocap_pos)
        zero = jnp.zeros(())
        info = {name: jnp.full(size, jnp.nan) for name, size in self.task.commands.items()}
        info |= {"memory": start.memory, "first_memory": start.memory, "model": start.model, "truncation": zero}
        if start.privileged is not None:
            blocks = privileged_blocks.split(privileged_blocks.sizes(self.task), start.privileged)
            info["privileged"] = self._privileged_vector(start.model, blocks)
        metric_names = [f"reward_{name}" for name in self.task.settings.weights]
        metrics = dict.fromkeys([*metric_names, "diverged", "overflow"], zero)
        return WorldState(data, start.observation, reward=zero, done=zero, metrics=metrics, info=info)

    def step(self, state: WorldState, action) -> WorldState:
        """Return the state after a control step.

        A world that diverges is done, with reward 0, and goes on from the model's default state, as in MuJoCo.

        Args:
            state: before the control step.
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
            index: index of the world to draw, in states of many worlds; None for states of one world.

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
        """Return the picture of a world; see `render`."""

        def select_world(leaf):
            array = np.asarray(leaf)
            return array if index is None else array[index]

        scene = self.task.scene
        fields = device.select_fields(state.data, ("mocap_pos", *self.task.reads))
        world_fields = jax.tree.map(select_world, vars(fields))
        memory = jax.tree.map(select_world, state.info["memory"])
        readings = self.task.read(types.SimpleNamespace(**world_fields))
        return pictures.picture(
            scene.body,
            scene.arena,
            qpos=world_fields["qpos"],
            mocap_pos=world_fields["mocap_pos"],
            markers=self.task.markers(memory, readings),
            failed_legs=self.task.failed_legs(memory),
            **options,
        )

    def _privileged_vector(self, model, blocks):
        """Return the privileged observation (size,).

        Fields of the model that wrappers have changed for all episodes replace what was drawn.

        Args:
            model: fields of the model that the episode has drawn, by name.
            blocks: blocks of the privileged observation, by name.
        """
        changed_fields = {}
        for name in self.task.read_back_fields:
            field = getattr(self._mjx_model, name)
            is_changed = field is not getattr(self._unchanged_model, name)
            if name not in model and is_changed:
                changed_fields[name] = field
        changed_blocks = self.task.read_back(blocks, changed_fields)
        return privileged_blocks.vector(self.task, {**blocks, **changed_blocks}, jnp.float32)

    def _step(self, state: WorldState, action) -> WorldState:
        task = self.task
        info = state.info
        data_before = state.data

        # Wrappers may set the data to a start without the memory of the start.
        is_start = data_before.time == 0.0
        memory_before = jax.tree.map(
            lambda first, latest: jnp.where(is_start, first, latest), info["first_memory"], info["memory"]
        )
        for name in task.commands:
            memory_before = task.with_command(memory_before, name, info[name])

        # Simulate.
        memory, inputs = task.before(memory_before, action)
        data = _with_inputs(data_before, inputs, task.scene.layout.torso)
        data = device.advance(self._mjx_model.replace(**info["model"]), data, self.n_substeps)
        diverged = device.has_diverged(data)
        overflow = device.has_overflow(data)

        # Reward and observation.
        fields = device.select_fields(data, task.reads)
        readings = task.read(fields)
        memory = task.after(memory, readings)
        unweighted_terms, reward = terms.reward(task.terms(memory, readings), task.settings.weights, task.cost_limit)
        observation = task.vector(task.observe(memory, readings), jnp.float32)
        terminated, truncated = task.ended(memory, readings)

        # Sums of substeps round; the time after k control steps is k dt.
        data = data.replace(time=(jnp.round(data_before.time / self.dt) + 1.0) * self.dt)

        # A world that has diverged goes on from the default state of the model, with the memory of before.
        default_data = self._data
        data = data.replace(
            qpos=jnp.where(diverged, default_data.qpos, data.qpos),
            qvel=jnp.where(diverged, default_data.qvel, data.qvel),
            qacc_warmstart=jnp.where(diverged, default_data.qacc_warmstart, data.qacc_warmstart),
        )
        next_memory = jax.tree.map(
            lambda after, before: jnp.where(diverged, before, after).astype(before.dtype), memory, memory_before
        )
        metrics = {f"reward_{name}": jnp.where(diverged, 0.0, term) for name, term in unweighted_terms.items()}
        metrics |= {"diverged": diverged, "overflow": overflow}
        next_info = {
            **info,
            "memory": next_memory,
            "truncation": _to_float(diverged | (truncated & ~terminated)),
        }
        if "privileged" in info:
            vector = self._privileged_vector(info["model"], task.privileged(next_memory, fields))
            next_info["privileged"] = jnp.where(diverged, 0.0, vector)
        return WorldState(
            data=data,
            obs=jnp.where(diverged, 0.0, observation),
            reward=_to_float(jnp.where(diverged, 0.0, reward)),
            done=_to_float(terminated | truncated | diverged),
            # Metrics of wrappers stay.
            metrics=state.metrics | {name: _to_float(metric) for name, metric in metrics.items()},
            info=next_info,
        )


def _with_inputs(data, inputs: Inputs, torso: int):
    """Return the data of a simulation with the inputs of a control step.

    Args:
        data: of the simulation.
        inputs: inputs of the control step.
        torso: index of the torso among the bodies of the model.
    """
    controls = inputs.ctrl.shape[-1]  # those of the body come first
    data = data.replace(ctrl=data.ctrl.at[:controls].set(inputs.ctrl))
    if inputs.kick is not None:
        data = data.replace(qvel=data.qvel.at[..., : inputs.kick.shape[-1]].add(inputs.kick))
    if inputs.force is not None:
        data = data.replace(xfrc_applied=data.xfrc_applied.at[torso, :3].set(inputs.force))
    return data


def restart_at_ends(state: WorldState, start: WorldState, ended) -> WorldState:
    """Return the state after a step; where the episode has ended, that of the first step of another episode.

    Args:
        state: after a step.
        start: start of the other episode.
        ended: () whether the episode has ended.
    """

    def choose(start_tree, tree):
        return jax.tree.map(lambda first, latest: jnp.where(ended, first, latest), start_tree, tree)

    fields = {name: choose(getattr(start.data, name), getattr(state.data, name)) for name in START_FIELDS}
    return state.replace(
        data=state.data.replace(**fields),
        obs=choose(start.obs, state.obs),
        info=choose(start.info, state.info),
    )


def _to_float(value):
    return jnp.asarray(value).astype(float)
