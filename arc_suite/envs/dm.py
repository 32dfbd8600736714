"""Tasks as dm_env environments: dm_control's `Environment` around any task of the contract."""

import collections
import functools
import math
import os
from collections.abc import Mapping
from typing import Any

import dm_env
import numpy as np
from dm_control.rl import control
from dm_env import specs

from arc_suite import checks
from arc_suite.envs import snapshots, trees
from arc_suite.envs.calls import (
    KnownAttributes,
    LiveCommands,
    Lock,
    checked_action,
    checked_command,
    one_thread_at_a_time,
)
from arc_suite.envs.prepare import checked_changes, prepare_task
from arc_suite.envs.task_view import TaskView
from arc_suite.robots.spec import Body
from arc_suite.simulation.model import checked_fields
from arc_suite.simulation.physics import Physics
from arc_suite.tasks import Task, privileged, terms
from arc_suite.tasks.contract import CURRICULUM

_FLAT = "observations"  # dm_control's name of a flat observation

# What `dm_control.suite.load` hands on to an environment and this suite fixes, and why.
_FIXED = {
    "control_timestep": "reward and observation are made for the body's own control steps",
    "n_sub_steps": "reward and observation are made for the body's own control steps",
    "legacy_step": "observed contact forces and foot heights stand one substep behind the state",
    "time_limit": "it is a setting of the task: task_kwargs={'time_limit': seconds}",
}


def load(
    domain_name: str | os.PathLike | Body,
    task_name: str,
    task_kwargs: Mapping[str, Any] | None = None,
    environment_kwargs: Mapping[str, Any] | None = None,
    visualize_reward: bool = False,
) -> "Environment":
    """Open an environment, as `dm_control.suite.load` does.

    Args:
        domain_name: a robot: queen, bastion, tick or leaper; one of another package, as `module:name`
            where that has not been imported yet; or any body; see `registry.body_of`.
        task_name: walk, steer, or a task of another package as `module:name`.
        task_kwargs: settings of the task; for every task `time_limit` (s), `arena`, `random` (a seed
            or `RandomState`) and `on_divergence` ("raise" an error or "terminate" the episode with
            reward 0), and disturbances, motors and senses, see `arc_suite.tasks.modifiers`;
            for walk `gait`, `weights`, and every target and threshold, see `arc_suite.tasks.walk.WalkSettings`.
        environment_kwargs: `flat_observation=True` gives one vector in place of named blocks. Of what
            else dm_control's environments take, steps and substeps are part of the benchmark and are
            refused, and `time_limit` is a setting of the task.
        visualize_reward: let rendered pictures show the reward as a color.

    Returns:
        An `Environment`, which is a `dm_control.rl.control.Environment`.

    Raises:
        ValueError: an unknown name, or a value that does not fit.
        OSError: a file that cannot be read.
    """
    settings = dict(checks.mapping("task_kwargs", task_kwargs))
    options = checks.mapping("environment_kwargs", environment_kwargs)
    random, on_divergence = settings.pop("random", None), settings.pop("on_divergence", "raise")
    task, _ = prepare_task(domain_name, task_name, settings)
    for name in options:
        if name in _FIXED:
            raise ValueError(f"environment setting {name!r}: {_FIXED[name]}")
        checks.name(name, ["flat_observation"], "environment setting")
    run = TaskRun(task, random, on_divergence, options.get("flat_observation", False))
    run.visualize_reward = visualize_reward
    return Environment(Physics.from_body(task.scene.body, task.scene.arena), run, settings)


class Environment(KnownAttributes, control.Environment):
    """A task in a simulation; steps, resets and specs are those of dm_control.

    While one thread is in a step or reset, another's is refused with a RuntimeError. Any thread may set commands.

    Attributes:
        task_kwargs: the settings with which `load` opened the task.
    """

    def __init__(self, physics: Physics, run: "TaskRun", task_kwargs: Mapping[str, Any]):
        """Put a task's run and its simulation together; `load` makes both."""
        self.task_kwargs = task_kwargs
        self._lock = Lock()
        limit, scene = run.definition.step_limit, run.definition.scene
        run.simulated_by(physics)
        super().__init__(
            physics,
            run,
            # Half a step short, so that rounding adds none.
            time_limit=math.inf if limit == math.inf else (limit - 0.5) * scene.control_timestep,
            n_sub_steps=scene.substeps,
            legacy_step=False,  # which would move the contact forces and foot heights one substep on
        )
        self._made = __name__

    step = one_thread_at_a_time(control.Environment.step)

    @one_thread_at_a_time
    def change_model(self, fields: Mapping[str, Any]) -> None:
        """Set fields of the model from the next step on; they stay over resets.

        What the task would draw of a changed field, as modifiers draw friction and mass, gives way to it.

        Args:
            fields: values by name of `simulation.model.FIELDS`, the fields of `MjModel` and `gravity`; what broadcasts
                to the field's shape.

        Raises:
            ValueError: no such field, one without effect, or a value that does not fit.
        """
        self.physics.change_model(checked_fields(self.physics.model.ptr, fields), lasting=True)

    @one_thread_at_a_time
    def change_settings(self, settings: Mapping[str, Any]) -> None:
        """Set settings of the task from the next reset on.

        They replace values of `task_kwargs` and of earlier calls. What changes the arena, the observation, or whether
        there are kicks and other modifiers is refused. `level` begins the curriculum again at that level.

        Args:
            settings: some of `task_kwargs`.

        Raises:
            ValueError: an unknown name, or a setting that cannot be changed.
        """
        run = self.task
        changes, task = checked_changes(run.opened, self.task_kwargs, run.next_changes, settings)
        run.put_changes(changes, task, restart=CURRICULUM[1] in settings)

    @one_thread_at_a_time
    def snapshot(self) -> dict[str, np.ndarray]:
        """Return the state as arrays by name, from which `restore` goes on, or a `VectorEnv` of one environment.

        Raises:
            RuntimeError: before the first reset.
        """
        if self.task.memory is None:
            raise RuntimeError("cannot take a snapshot: no episode has begun; call reset first")
        return snapshots.to_arrays(self._state())

    @one_thread_at_a_time
    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Go on, bit-exact, from the snapshot of an environment of the same task.

        Raises:
            ValueError: an array is missing or does not fit; none has been used.
        """
        run = self.task
        if run.memory is None:
            super().reset()
        like = self._state()
        check = functools.partial(self.physics.checked, fields=run.definition.reads)
        state, tasks = snapshots.from_arrays(like, run.definition, check, arrays, [run.opened], self.task_kwargs)
        self.physics.restore(state.simulations)
        run.restore(state, *(each for (each,) in tasks))
        own = {name: array[0] for name, array in state.environment_arrays.items()}
        self._step_count, self._reset_next_step = int(own["steps"]), bool(own["ended"])

    def _state(self) -> snapshots.State:
        """The state, with a leading axis as that of a `VectorEnv` of one environment."""
        simulations = self.physics.snapshot(self.task.definition.reads)
        return self.task.state(simulations, self.physics, self._step_count, self._reset_next_step)

    @one_thread_at_a_time
    def reset(self, seed: int | None = None) -> dm_env.TimeStep:
        """Start an episode.

        Args:
            seed: starts a new stream of random numbers, in which this is the first episode; None
                for the next episode of the present stream.

        Raises:
            ValueError: not a seed.
            RuntimeError: another thread is at work in the environment.
        """
        if seed is not None:
            self.task.random = np.random.RandomState(checks.seed(seed))
        return super().reset()

    def command(self, name: str, value) -> None:
        """Set a command of the task from the next step on, as a player's stick does, until the next episode.

        Any thread may call it while another is in a step, which goes on with the command before.

        Args:
            name: one of the task's `commands`.
            value: (size,) numbers; None, or NaN in some, for what the task itself would do.

        Raises:
            ValueError: no such command, or a value of another size.
        """
        self.task.set_command(name, value)

    def observation_spec(self):
        """Return the specs of the observation's blocks by name, or of the flat vector."""
        return self.task.observation_spec(self.physics)


class _Now:
    """What every step sets, in an object of its own: setting an attribute of a `TaskRun` is checked, and slower.

    Attributes:
        memory: of the present episode; None before the first.
        readings: of the latest step; None where they are to be taken anew.
        terms: unweighted, of the latest reward by name.
    """

    def __init__(self):
        """Start before the first episode."""
        self.memory, self.readings, self.terms = None, None, {}


class TaskRun(TaskView, KnownAttributes, control.Task):
    """A task in one simulation, episode after episode, as dm_control's `Task`: it keeps the memory.

    Attributes:
        definition: the task of the present episode, a value of the contract.
        opened: the task before `Environment.change_settings`.
        next_changes: JSON of the settings that differ in the next episode.
        memory: of the present episode, as the next step will find it; None before the first.
        visualize_reward: whether rendered pictures show the reward as a color.
    """

    def __init__(self, task: Task, random=None, on_divergence: str = "raise", flat: bool = False):
        """Prepare to run.

        Args:
            task: what to do.
            random: a `RandomState`, or what one is seeded with.
            on_divergence: what a step does whose physics diverges: "raise" an error, or "terminate"
                the episode with reward 0.
            flat: whether observations are one vector.

        Raises:
            ValueError: an unknown `on_divergence`, or not a seed.
        """
        if not isinstance(random, np.random.RandomState):
            random = np.random.RandomState(None if random is None else checks.seed(random))
        self.definition = self.opened = self._next = task
        self._changes = self.next_changes = "{}"
        self._now, self._stream = _Now(), None
        self._commands = LiveCommands()
        self.visualize_reward = False
        self.random = random
        self._on_divergence = checks.name(on_divergence, ("raise", "terminate"), "on_divergence")
        self._flat = flat
        self._starting = False  # between a reset and its observation
        self._motors = (len(task.scene.body.joint_names),)
        self._made = __name__

    @property
    def random(self) -> np.random.RandomState:
        """What starts of episodes are drawn from; a new one begins a new stream of episodes."""
        return self._random

    @random.setter
    def random(self, value: np.random.RandomState):
        self._random, self._stream_begins = value, True

    @property
    def terms(self) -> Mapping[str, Any]:
        """The unweighted terms of the latest reward by name; empty before the first step."""
        return self._now.terms

    @property
    def memory(self) -> Any:
        """The memory of the present episode."""
        return self._commands.peek(self.definition, self._now.memory)

    @memory.setter
    def memory(self, value: Any):
        self._now.memory = value

    @property
    def progress(self) -> dict[str, float]:
        """How well the episode has gone so far, figures by name.

        Raises:
            RuntimeError: before the first reset.
        """
        self._check_begun()
        return {name: float(figure) for name, figure in self.definition.progress(self._now.memory).items()}

    def simulated_by(self, physics: Physics) -> None:
        """Remember the simulation, in which privileged observations are looked up."""
        self._physics = physics

    @property
    def privileged(self) -> dict[str, np.ndarray]:
        """What no policy observes, by the names of `definition.privileged_blocks`, now.

        Raises:
            RuntimeError: before the first reset.
        """
        self._check_begun()
        found = self.definition.privileged(self.memory, self._physics.data.ptr)
        return found | self.definition.read_back(found, self._physics.lasting)

    def privileged_vector(self) -> np.ndarray:
        """Return the same as one vector (size,) float32."""
        return privileged.vector(self.definition, self.privileged)

    def _check_begun(self) -> None:
        if self._now.memory is None:
            raise RuntimeError("no episode has begun; call reset first")

    def set_command(self, name: str, value) -> None:
        """Set a live command; see `Environment.command`.

        Raises:
            ValueError: no such command, a value that does not fit, or no episode has begun.
        """
        value = checked_command(self.definition, name, value)
        if self._now.memory is None:
            raise ValueError(f"command {name!r}: no episode has begun; reset first")
        self._commands.put(name, value)

    def action_spec(self, physics):
        """Return the spec of one control in [-1, 1] for each motor or servo of the legs."""
        joints = (len(self.body.joint_names),)
        return specs.BoundedArray(joints, float, -np.ones(joints), np.ones(joints))

    def observation_spec(self, physics):
        """Return the specs of the observation's blocks by name, or of the flat vector."""
        sizes = {_FLAT: self.definition.size} if self._flat else self.definition.sizes
        return collections.OrderedDict((name, specs.Array((size,), float, name)) for name, size in sizes.items())

    def initialize_episode(self, physics):
        """Draw how the episode starts, and write it."""
        self._take_commands()
        self._stream = self._next.first() if self._stream_begins else self.definition.stream_state(self._now.memory)
        self._stream_begins = False
        self.definition, self._changes = self._next, self.next_changes
        start = self.definition.start(self._random, self._stream)
        if start.model:
            physics.change_model(start.model)
        data = physics.data.ptr
        data.qpos[:], data.qvel[:] = start.qpos, start.qvel
        if start.mocap_pos is not None:
            data.mocap_pos[:] = start.mocap_pos
        physics.shown_reward, physics.marker, physics.failed_legs = None, self.markers, self.failed_legs
        self._now.memory, self._starting = start.memory, True

    def before_step(self, action, physics):
        """Apply the action, clipped to [-1, 1].

        Raises:
            ValueError: the action has another shape or holds NaN; nothing has changed then.
        """
        action = checked_action(action, self._motors)
        self._now.memory, inputs = self.definition.before(
            self._commands.consume(self.definition, self._now.memory), action
        )
        data = physics.data.ptr
        physics.marker, physics.failed_legs = self.markers, self.failed_legs  # which a copy of the simulation has not
        data.ctrl[: inputs.ctrl.shape[-1]] = inputs.ctrl
        if inputs.kick is not None:
            data.qvel[:] += inputs.kick
        if inputs.force is not None:
            data.xfrc_applied[self.definition.scene.layout.torso, :3] = inputs.force

    def after_step(self, physics):
        """Take the readings, and what is to be remembered of the step.

        Raises:
            PhysicsError: the physics diverged and is not to terminate the episode.
        """
        if physics.divergence is not None and self._on_divergence == "raise":
            raise control.PhysicsError(f"{self.body.name}: {physics.divergence}")
        self._now.readings = self.definition.read(physics.data.ptr)
        self._now.memory = self.definition.after(self._now.memory, self._now.readings)

    def get_reward(self, physics):
        """Return the reward of the latest step, whose terms stay in `terms`."""
        task, weights = self.definition, self.definition.settings.weights
        raw = task.terms(self._now.memory, self._latest(physics))
        if physics.divergence is not None:
            raw = dict.fromkeys(raw, np.float64(0.0))
        self._now.terms, reward = terms.reward(raw, weights, task.cost_limit)
        if self.visualize_reward:
            physics.shown_reward = reward / (terms.greatest(weights) or 1.0)
        return reward

    def get_observation(self, physics):
        """Return the observation's blocks by name; or one vector of them, as `observations`."""
        readings = self._begin(physics) if self._starting else self._latest(physics)
        blocks = self.definition.observe(self._now.memory, readings)
        return {_FLAT: self.definition.vector(blocks)} if self._flat else self.definition.named(blocks)

    def get_termination(self, physics):
        """Return 0 where the task is failed or the physics has diverged, 1 where it cuts the episode off, else None."""
        if physics.divergence is not None:
            return 0.0
        terminated, truncated = self.definition.ended(self._now.memory, self._latest(physics))
        self._now.readings = None  # stale as soon as the simulation moves
        return 0.0 if terminated else 1.0 if truncated else None

    def markers(self, physics):
        """Return what pictures show of what the task asks for now."""
        return self.definition.markers(self.memory, self._latest(physics))

    def failed_legs(self) -> tuple[str, ...]:
        """Return the names of the legs whose motors have failed."""
        return self.definition.failed_legs(self._now.memory)

    def put_changes(self, changes: str, task: Task, restart: bool) -> None:
        """Let a task with changed settings, and JSON of these, hold from the next episode on.

        With `restart` that episode starts as the first of a stream.
        """
        self.next_changes, self._next = changes, task
        self._stream_begins |= restart

    def state(self, simulations: Mapping[str, np.ndarray], physics, steps: int, ended: bool) -> snapshots.State:
        """Return the state of an environment, with a leading axis, given that of its simulation."""
        self._take_commands()
        task = self.definition
        observation = task.vector(task.observe(self._now.memory, task.read(physics.data.ptr)), np.float32)
        values = (-1, self._stream_begins, steps, ended, False, observation)
        return snapshots.State(
            simulations=simulations,
            memory=trees.map_leaves(lambda leaf: np.asarray(leaf)[None], self._now.memory),
            streams=[self._stream],
            randoms=[self._random.get_state()],
            environment_arrays={
                name: np.asarray(value)[None] for name, value in zip(snapshots.ENVIRONMENT_ARRAYS, values, strict=True)
            },
            settings=([self._changes], [self.next_changes]),
        )

    def restore(self, state: snapshots.State, task: Task, next_task: Task) -> None:
        """Go on from a state, given the task of its episode and that of the next."""
        self._now.memory = trees.map_leaves(
            lambda leaf, like: snapshots.number(leaf[0], like), state.memory, self._now.memory
        )
        (self._stream,), (self._changes,), (self.next_changes,) = state.streams, *state.settings
        self.definition, self._next, self._now.readings, self._starting = task, next_task, None, False
        self._random.set_state(state.randoms[0])
        self._stream_begins = bool(state.environment_arrays["streams_begin"][0])

    def _take_commands(self) -> None:
        if self._now.memory is not None:
            self._now.memory = self._commands.consume(self.definition, self._now.memory)

    def _latest(self, physics):
        """The readings of the latest step."""
        return self._now.readings or self.definition.read(physics.data.ptr)

    def _begin(self, physics):
        """Return the readings of the start, from which the memory keeps what the first step needs."""
        self._starting, data = False, physics.data.ptr
        readings = self.definition.read(data)
        lifted = self.definition.clear_spawn(self._now.memory, readings)
        if lifted is not None:
            data.qpos[:] = lifted
            physics.after_reset()
            readings = self.definition.read(data)
        self._now.memory, self._now.readings = self.definition.begin(self._now.memory, readings), None
        return readings
