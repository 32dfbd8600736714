"""Tasks as dm_env environments: dm_control's `Environment` for any task of the suite's contract."""

import collections
import copy
import functools
import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike

from arc_suite import checks, usage
from arc_suite.envs import snapshots, trees
from arc_suite.envs.calls import (
    KnownAttributes,
    LiveCommands,
    Lock,
    checked_action,
    checked_command,
    one_thread_at_a_time,
)
from arc_suite.envs.prepare import checked_changes, prepare_task, refuse_arguments, stored_settings
from arc_suite.envs.task_view import TaskView
from arc_suite.envs.timestep import TimeStep
from arc_suite.robots.spec import Body
from arc_suite.simulation.model import check_fields
from arc_suite.simulation.physics import Physics
from arc_suite.tasks import Task, privileged, terms
from arc_suite.tasks.contract import LEVEL
from arc_suite.tasks.readings import root_qpos, root_qvel

if TYPE_CHECKING:
    from arc_suite.envs import dm_types as control
    from arc_suite.envs import dm_types as specs
else:
    from dm_control.rl import control
    from dm_env import specs

_FLAT = "observations"  # dm_control's name of a flat observation

# Settings of dm_control's environments that this suite refuses, and why.
_REFUSED_SETTINGS = {
    "control_timestep": "reward and observation are made for the body's own control steps",
    "n_sub_steps": "reward and observation are made for the body's own control steps",
    "action_repeat": "reward and observation are made for the body's own control steps; repeat a step",
    "legacy_step": "observed contact forces and foot heights stand one substep behind the state",
    "time_limit": "it is a setting of the task: task_kwargs={'time_limit': seconds}",
}


def load(
    domain_name: str | os.PathLike[str] | Body,
    task_name: str,
    task_kwargs: Mapping[str, Any] | None = None,
    environment_kwargs: Mapping[str, Any] | None = None,
    visualize_reward: bool = False,
    **others: Any,
) -> "Environment":
    """Open an environment, as `dm_control.suite.load` does.

    Args:
        domain_name: a robot: queen, bastion, tick or leaper; one of another package, as `module:name`
            if the module has not been imported yet; or any body; see `registry.body_of`.
        task_name: one of the suite's, see docs/tasks.md, or a task of another package as `module:name`.
        task_kwargs: settings of the task; for every task `time_limit` (s), `arena`, `random` (a seed
            or `RandomState`) and `on_divergence` ("raise" an error or "truncate" the episode with
            reward 0), and disturbances, motors and senses, see `arc_suite.tasks.modifiers`;
            for walk `gait`, `weights`, and every target and threshold, see `arc_suite.tasks.walk.WalkSettings`.
        environment_kwargs: `flat_observation=True` gives one vector in place of named blocks. Other settings of
            dm_control's environments are refused: steps and substeps are part of the benchmark, and `time_limit` is a
            setting of the task.
        visualize_reward: whether rendered pictures show the reward as a color.
        **others: none; they are refused with what takes their place.

    Returns:
        An `Environment`, which is a `dm_control.rl.control.Environment`.

    Raises:
        ValueError: an unknown name, or a value that does not fit.
        OSError: a file that cannot be read.
    """
    refuse_arguments(others, load, task_name)
    settings = dict(checks.mapping("task_kwargs", task_kwargs))
    options = checks.mapping("environment_kwargs", environment_kwargs)
    random = settings.pop("random", None)
    on_divergence = settings.pop("on_divergence", "raise")
    task, _ = prepare_task(domain_name, task_name, settings)
    for name in options:
        if name in _REFUSED_SETTINGS:
            raise ValueError(f"environment setting {name!r}: {_REFUSED_SETTINGS[name]}")
        checks.name(name, ["flat_observation"], "environment setting")
    is_flat = checks.boolean("flat_observation", options.get("flat_observation", False))
    run = TaskRun(task, random, on_divergence, is_flat)
    run.visualize_reward = checks.boolean("visualize_reward", visualize_reward)
    return Environment(Physics.from_body(task.scene.body, task.scene.arena), run, stored_settings(task, settings))


class Environment(KnownAttributes, control.Environment):
    """A task in a simulation; steps, resets and specs are those of dm_control.

    While one thread is in a step or reset, those of other threads raise RuntimeError. Any thread may set commands.

    Attributes:
        task_kwargs: the settings with which `load` opened the task; texts stand for files.
    """

    if TYPE_CHECKING:  # dm_env and dm_control leave these types open

        def control_timestep(self) -> float: ...
        def reward_spec(self) -> specs.Array: ...
        def discount_spec(self) -> specs.BoundedArray: ...
        def close(self) -> None: ...
        def __enter__(self) -> Self: ...
        def __exit__(self, *error: object) -> None: ...

    def __init__(self, physics: Physics, run: "TaskRun", task_kwargs: Mapping[str, Any]):
        """Combine a task's run and its simulation; `load` makes both."""
        self.task_kwargs = task_kwargs
        self._lock = Lock()
        step_limit = run.definition.step_limit
        scene = run.definition.scene
        # Half a step less than the limit, so that rounding does not add a step; infinite if the limit is infinite.
        time_limit = (step_limit - 0.5) * scene.control_timestep
        run.set_physics(physics)
        super().__init__(
            physics,
            run,
            time_limit=time_limit,
            n_sub_steps=scene.substeps,
            legacy_step=False,  # True would shift the contact forces and foot heights by one substep
        )
        self._sealed_by = __name__

    @property
    def physics(self) -> Physics:
        """The simulation."""
        return self._physics

    @property
    def task(self) -> "TaskRun":
        """The run of the task, with its progress and the terms of its reward."""
        return self._task

    def action_spec(self) -> specs.BoundedArray:
        """Return the spec of one control in [-1, 1] for each motor or servo of the legs."""
        return self.task.action_spec(self.physics)

    @one_thread_at_a_time
    def step(self, action: ArrayLike) -> TimeStep:
        """Advance by one control step, or start an episode after the end of one; see dm_control.

        A fall terminates the episode, in its last possible step, too: its discount is 0.
        """
        if usage.recording and not self._reset_next_step:
            usage.check_seeds([self.task.stream_seed])
        timestep = super().step(action)
        if usage.recording and not timestep.first():
            usage.count_steps(1)
        # dm_control does not ask the task in the step of the time limit.
        if timestep.last() and timestep.discount and self.task.has_failed(self.physics):
            return timestep._replace(discount=0.0)
        return timestep

    @one_thread_at_a_time
    def change_model(self, fields: Mapping[str, Any]) -> None:
        """Set fields of the model from the next step on. Resets do not undo it.

        Modifiers draw friction, mass and other fields for each episode. A field that was set here keeps its value.

        Args:
            fields: values by name. A name is one of `simulation.model.FIELDS`, which are fields of `MjModel` and
                `gravity`, or of `CONTACT_PROPERTIES`: friction, solref, solimp or margin of all contacts. A value
                must broadcast to the shape of the field or property.

        Raises:
            ValueError: an unknown field, one without effect, or a value that does not fit.
        """
        physics = self.physics
        physics.check_process()
        checked_fields = check_fields(physics.model.ptr, fields, compiled_field=physics.compiled_field)
        physics.change_model(checked_fields, lasting=True)

    @one_thread_at_a_time
    def change_settings(self, settings: Mapping[str, Any]) -> None:
        """Set settings of the task from the next reset on.

        They replace values of `task_kwargs` and of earlier calls. A setting is refused if it would change the arena,
        the observation, or the presence of a curriculum, of kicks or of other modifiers. `level` restarts the
        curriculum at that level.

        Args:
            settings: some of `task_kwargs`.

        Raises:
            ValueError: an unknown name, or a setting that cannot be changed.
        """
        self.physics.check_process()
        run = self.task  # dm_control calls a `TaskRun` the task
        changes, next_task = checked_changes(run.opened, self.task_kwargs, run.next_changes, settings)
        run.put_changes(changes, next_task, restart=LEVEL in settings)

    @one_thread_at_a_time
    def snapshot(self) -> dict[str, np.ndarray]:
        """Return the state as arrays by name, for `restore` of this environment or of a `VectorEnv` of one.

        Raises:
            RuntimeError: before the first reset.
            ValueError: `task.random` is no generator of the kind of `RandomState(seed)`.
        """
        self.physics.check_process()
        if self.task.memory is None:
            raise RuntimeError("cannot take a snapshot: no episode has begun; call reset first")
        simulations = self.physics.snapshot(self.task.definition.reads)
        return snapshots.to_arrays(self._state(simulations), [self.task.opened])

    @one_thread_at_a_time
    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Continue, bit-exactly, from the snapshot of an environment of the same task.

        Raises:
            ValueError: an array is missing or does not fit, or a seed that the run that learns may not play; the state
                has not changed.
        """
        self.physics.check_process()
        run = self.task  # dm_control calls a `TaskRun` the task
        begun = self._begun()
        check_simulations = functools.partial(self.physics.check_snapshot, fields=run.definition.reads)
        state, (present_tasks, next_tasks) = snapshots.from_arrays(
            begun._state({}), begun.task.definition, check_simulations, arrays, [run.opened], self.task_kwargs
        )
        usage.check_seeds(state.environment_arrays["stream_seeds"].tolist())
        self.physics.restore(state.simulations)
        run.restore(state, present_tasks[0], next_tasks[0], like=begun.task.memory)
        run.add_to_pictures(self.physics)
        self._step_count = int(state.environment_arrays["steps"][0])
        self._reset_next_step = bool(state.environment_arrays["ended"][0])

    def _begun(self) -> Self:
        """Return this environment if an episode has begun; else a copy in which one has, as a snapshot has."""
        if self.task.memory is not None:
            return self
        begun_copy = copy.deepcopy(self)
        control.Environment.reset(begun_copy)
        return begun_copy

    def __setstate__(self, state: dict[str, Any]) -> None:
        super().__setstate__(state)
        if self.task.memory is not None:  # copies of a simulation know nothing of a task
            self.task.add_to_pictures(self.physics)

    def _state(self, simulations: Mapping[str, np.ndarray]) -> snapshots.State:
        """Return the state with these arrays of the simulation, as that of a `VectorEnv` of one environment."""
        return self.task.state(simulations, self.physics, self._step_count, self._reset_next_step)

    @one_thread_at_a_time
    def reset(self, seed: int | None = None) -> TimeStep:
        """Start an episode.

        Args:
            seed: starts a new stream of random numbers with this episode; None
                for the next episode of the present stream. While a run learns, a stream of unknown seed ends, and a
                new one begins with a seed of the run.

        Raises:
            ValueError: the seed is not valid.
            RuntimeError: another thread is at work in the environment.
        """
        if seed is not None:
            self.task.begin_stream(seed)
        elif usage.recording and self.task.stream_seed == usage.UNKNOWN_SEED:
            for drawn_seed in usage.draw_seeds(1):
                self.task.begin_stream(drawn_seed)
        return super().reset()

    def command(self, name: str, value: ArrayLike | str | None) -> None:
        """Set a command of the task from the next step on, until the next episode; for example from a player's stick.

        Any thread may call it while another is in a step, which still uses the earlier command.

        Args:
            name: one of the task's `commands`.
            value: (size,) numbers, or a name that the command has for them. None and NaN leave the command, or some of
                its numbers, to the task itself.

        Raises:
            ValueError: an unknown command, or a value of another size.
        """
        self.physics.check_process()
        self.task.set_command(name, value)

    def observation_spec(self) -> Mapping[str, specs.Array]:
        """Return the specs of the observation's blocks by name, or of the flat vector."""
        return self.task.observation_spec(self.physics)


class _Now:
    """The values that change in every step of a `TaskRun`.

    They are in an object of their own, as setting an attribute of a `TaskRun` is slower: it is checked.

    Attributes:
        memory: memory of the present episode; None before the first.
        earlier_memory: memory before the action of the latest step; None before the first.
        readings: readings of the present state; None if they have to be read from the simulation.
        terms: unweighted terms of the latest reward by name.
    """

    def __init__(self):
        """Start before the first episode."""
        self.memory = None
        self.earlier_memory = None
        self.readings = None
        self.terms = {}


class TaskRun(TaskView, KnownAttributes, control.Task):
    """A task in one simulation, episode after episode, as dm_control's `Task`. It stores the memory between steps.

    Attributes:
        definition: the task of the present episode, see `tasks.contract.Task`.
        opened: the task with the settings with which the environment was opened.
        next_changes: JSON of the settings of the next episode that differ from those.
        memory: memory of the present episode with the live commands, as the next step will use it; None before the
            first.
        visualize_reward: whether rendered pictures show the reward as a color.
    """

    _FORMER_NAMES = {  # in pickles of earlier versions
        **KnownAttributes._FORMER_NAMES,
        "_next": "_next_task",
        "_changes": "_present_changes",
        "_starting": "_is_starting",
        "_motors": "_action_shape",
    }

    _stream_seed: int = usage.UNKNOWN_SEED  # in pickles of earlier versions, which do not hold it

    def __init__(self, task: Task, random=None, on_divergence: str = "raise", flat: bool = False):
        """Prepare to run.

        Args:
            task: the definition of the task.
            random: a `RandomState`, or a seed of one; None for a random seed.
            on_divergence: what a step does if its physics diverges: "raise" an error, or "truncate"
                the episode with reward 0.
            flat: whether observations are one vector.

        Raises:
            ValueError: an unknown `on_divergence`, or a seed that is not valid.
        """
        self.definition = task
        self.opened = task
        self._next_task = task
        self._present_changes = "{}"  # JSON of changed settings, as `next_changes` but of the present episode
        self.next_changes = "{}"
        self._now = _Now()  # what changes in every step
        self._stream = None  # state of the stream with which the present episode has started
        self._commands = LiveCommands()
        self.visualize_reward = False
        if isinstance(random, np.random.RandomState):
            self.random = random
        else:
            self.begin_stream(random)
        self._on_divergence = checks.name(on_divergence, ("raise", "truncate"), "on_divergence")
        self._flat = flat
        self._is_starting = False  # True between a reset and its observation
        self._action_shape = (len(task.scene.body.joint_names),)
        self._sealed_by = __name__

    @property
    def random(self) -> np.random.RandomState:
        """The generator of the starts of episodes; setting a new one begins a new stream of episodes."""
        return self._random

    @random.setter
    def random(self, value: np.random.RandomState):
        usage.check_seeds([usage.UNKNOWN_SEED])
        self._set_stream(value, usage.UNKNOWN_SEED)

    @property
    def stream_seed(self) -> int:
        """The seed of the stream of episodes; -1 if it is unknown."""
        return self._stream_seed

    def begin_stream(self, seed: int | None) -> None:
        """Begin a new stream of episodes with the next one; of a random seed for None.

        Raises:
            ValueError: a seed that is not valid, or one that the run that learns may not play.
        """
        if seed is None:
            self._set_stream(np.random.RandomState(), usage.UNKNOWN_SEED)
            return
        valid_seed = checks.seed(seed)
        usage.check_seeds([valid_seed])
        self._set_stream(np.random.RandomState(valid_seed), valid_seed)

    def _set_stream(self, random: np.random.RandomState, seed: int) -> None:
        self._random = random
        self._stream_seed = seed
        self._stream_begins = True  # with the next episode

    @property
    def terms(self) -> Mapping[str, float]:
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
        """How well the episode has gone so far, metrics by name.

        Raises:
            RuntimeError: before the first reset.
        """
        self._check_begun()
        return {name: float(metric) for name, metric in self.definition.progress(self._now.memory).items()}

    def set_physics(self, physics: Physics) -> None:
        """Set the simulation, from which privileged observations are read."""
        self._physics = physics

    @property
    def privileged(self) -> dict[str, np.ndarray]:
        """The present privileged observation, by the names of `definition.privileged_blocks`.

        Raises:
            RuntimeError: before the first reset.
        """
        self._check_begun()
        blocks = self.definition.privileged(self.memory, self._physics.data.ptr)
        changed_fields = self._physics.lasting_fields  # those that `change_model` has set
        return blocks | self.definition.read_back(blocks, changed_fields)

    def privileged_vector(self) -> np.ndarray:
        """Return the present privileged observation as one vector (size,) float32."""
        return privileged.vector(self.definition, self.privileged)

    def _check_begun(self) -> None:
        """Raise RuntimeError before the first reset."""
        if self._now.memory is None:
            raise RuntimeError("no episode has begun; call reset first")

    def set_command(self, name: str, value) -> None:
        """Set a live command; see `Environment.command`.

        Raises:
            ValueError: an unknown command, a value that does not fit, or no episode has begun.
        """
        value = checked_command(self.definition, name, value)
        if self._now.memory is None:
            raise ValueError(f"command {name!r}: no episode has begun; reset first")
        self._commands.put(name, value)

    def action_spec(self, physics: Physics) -> specs.BoundedArray:
        """Return the spec of one control in [-1, 1] for each motor or servo of the legs."""
        shape = self._action_shape
        return specs.BoundedArray(shape, float, -np.ones(shape), np.ones(shape))

    def observation_spec(self, physics: Physics) -> collections.OrderedDict[str, specs.Array]:
        """Return the specs of the observation's blocks by name, or of the flat vector."""
        sizes = {_FLAT: self.definition.size} if self._flat else self.definition.sizes
        return collections.OrderedDict((name, specs.Array((size,), float, name)) for name, size in sizes.items())

    def initialize_episode(self, physics):
        """Draw the start of an episode, and write it into the simulation."""
        self._consume_commands()
        if self._stream_begins:
            self._stream = self._next_task.first()
        else:
            self._stream = self.definition.stream_state(self._now.memory)
        self._stream_begins = False
        self.definition = self._next_task
        self._present_changes = self.next_changes
        start = self.definition.start(self._random, self._stream)
        if start.model:  # fields of the model that modifiers have drawn
            physics.change_model(start.model)
        data = physics.data.ptr
        layout = self.definition.scene.layout
        data.qpos[:] = root_qpos(start.qpos, layout)
        data.qvel[:] = root_qvel(start.qvel, data.qpos, layout)
        if start.mocap_pos is not None:
            data.mocap_pos[:] = start.mocap_pos
        physics.shown_reward = None
        self.add_to_pictures(physics)
        self._now.memory = start.memory
        self._is_starting = True

    def add_to_pictures(self, physics: Physics) -> None:
        """Let pictures of a simulation show the markers and the failed legs of the task."""
        physics.marker = self.markers
        physics.failed_legs = self.failed_legs

    def before_step(self, action, physics):
        """Apply the action, clipped to [-1, 1].

        Raises:
            ValueError: the action has another shape or contains NaN; nothing has changed then.
        """
        action = checked_action(action, self._action_shape)
        memory = self._commands.consume(self.definition, self._now.memory)
        self._now.earlier_memory = memory
        self._now.memory, inputs = self.definition.before(memory, action)
        # Set in every step, as a copy of the simulation lacks both.
        physics.marker = self.markers
        physics.failed_legs = self.failed_legs
        data = physics.data.ptr
        data.ctrl[: inputs.ctrl.shape[-1]] = inputs.ctrl
        if inputs.kick is not None:
            data.qvel[: len(inputs.kick)] += inputs.kick
        if inputs.force is not None:
            data.xfrc_applied[self.definition.scene.layout.torso, :3] = inputs.force

    def after_step(self, physics):
        """Read the simulation after the step, and update the memory; a step that diverges leaves that of before.

        Raises:
            PhysicsError: the physics has diverged, and `on_divergence` is "raise".
        """
        if physics.divergence is None:
            self._now.readings = self.definition.read(physics.data.ptr)
            self._now.memory = self.definition.after(self._now.memory, self._now.readings)
            return
        self._now.memory = self._now.earlier_memory
        if self._on_divergence == "raise":
            raise control.PhysicsError(f"{self.body.name}: {physics.divergence}")
        self._now.readings = self.definition.read(physics.data.ptr)

    def get_reward(self, physics):
        """Return the reward of the latest step; `terms` returns its terms from then on."""
        task = self.definition
        weights = task.settings.weights
        raw_terms = task.terms(self._now.memory, self._readings(physics))
        if physics.divergence is not None:
            raw_terms = dict.fromkeys(raw_terms, np.float64(0.0))
        self._now.terms, reward = terms.reward(raw_terms, weights, task.cost_limit)
        if self.visualize_reward:
            greatest_reward = terms.greatest(weights) or 1.0  # it is 0 if all terms are costs
            physics.shown_reward = reward / greatest_reward
        return reward

    def get_observation(self, physics):
        """Return the observation's blocks by name, or a dictionary with one vector of them, `observations`."""
        readings = self._begin(physics) if self._is_starting else self._readings(physics)
        blocks = self.definition.observe(self._now.memory, readings)
        if self._flat:
            return {_FLAT: self.definition.vector(blocks)}
        return self.definition.copy_blocks(blocks)

    def get_termination(self, physics):
        """Return the discount at the end of an episode: 0 if terminated, 1 if truncated or diverged; else None."""
        if physics.divergence is not None:
            return 1.0
        terminated, truncated = self.definition.ended(self._now.memory, self._readings(physics))
        self._now.readings = None  # the simulation moves next
        if terminated:
            return 0.0
        return 1.0 if truncated else None

    def has_failed(self, physics) -> bool:
        """Return whether the task terminates the episode in the present state; a divergence does not."""
        if physics.divergence is not None:
            return False
        terminated, _ = self.definition.ended(self._now.memory, self._readings(physics))
        return bool(terminated)

    def markers(self, physics):
        """Return the debug markers of the task's present command, for pictures."""
        return self.definition.markers(self.memory, self._readings(physics))

    def failed_legs(self) -> tuple[str, ...]:
        """Return the names of the legs whose motors have failed."""
        return self.definition.failed_legs(self._now.memory)

    def put_changes(self, changes: str, task: Task, restart: bool) -> None:
        """Change settings from the next episode on.

        Args:
            changes: JSON of all changed settings.
            task: with these settings.
            restart: whether the next episode starts as the first of a stream.
        """
        self.next_changes = changes
        self._next_task = task
        self._stream_begins |= restart

    def state(self, simulations: Mapping[str, np.ndarray], physics, steps: int, ended: bool) -> snapshots.State:
        """Return the state of the environment, with a leading axis of 1.

        Args:
            simulations: arrays of the simulation by name, with this axis.
            physics: the simulation.
            steps: steps of the present episode.
            ended: whether the episode has ended.

        Raises:
            ValueError: the random numbers are of a generator that snapshots do not hold.
        """
        snapshots.check_generator(self._random)
        self._consume_commands()
        task = self.definition
        observation = task.vector(task.observe(self._now.memory, task.read(physics.data.ptr)), np.float32)
        environment_values = {
            "stream_seeds": self._stream_seed,
            "streams_begin": self._stream_begins,
            "steps": steps,
            "ended": ended,
            "resting": False,
            "observation": observation,
        }
        return snapshots.State(
            simulations=simulations,
            memory=trees.map_leaves(lambda leaf: np.asarray(leaf)[None], self._now.memory),
            streams=[self._stream],
            randoms=[self._random.get_state()],
            environment_arrays={name: np.asarray(value)[None] for name, value in environment_values.items()},
            settings=([self._present_changes], [self.next_changes]),
        )

    def restore(self, state: snapshots.State, task: Task, next_task: Task, like: Any) -> None:
        """Continue from a state.

        Args:
            state: as in a snapshot.
            task: the task of its episode.
            next_task: the task of the next episode.
            like: a memory of the task; numbers of the state's memory get the types of its numbers.
        """
        self._now.memory = trees.map_leaves(
            lambda array, like_leaf: snapshots.to_number_like(array[0], like_leaf), state.memory, like
        )
        self._now.readings = None
        self._now.terms = {}
        self._is_starting = False
        self.definition = task
        self._next_task = next_task
        self._stream = state.streams[0]
        present_texts, next_texts = state.settings
        self._present_changes = present_texts[0]
        self.next_changes = next_texts[0]
        self._random.set_state(state.randoms[0])
        self._stream_seed = int(state.environment_arrays["stream_seeds"][0])
        self._stream_begins = bool(state.environment_arrays["streams_begin"][0])

    def _consume_commands(self) -> None:
        """Put the live commands into the memory, if an episode has begun."""
        if self._now.memory is not None:
            self._now.memory = self._commands.consume(self.definition, self._now.memory)

    def _readings(self, physics):
        """Return the readings of the present state."""
        if self._now.readings is not None:
            return self._now.readings
        return self.definition.read(physics.data.ptr)

    def _begin(self, physics):
        """Complete the start of an episode, and return its readings.

        The body is lifted out of the ground, and the memory begins with the readings there.
        """
        self._is_starting = False
        data = physics.data.ptr
        readings = self.definition.read(data)
        clear_qpos = self.definition.clear_spawn(self._now.memory, readings)
        if clear_qpos is not None:
            data.qpos[:] = root_qpos(clear_qpos, self.definition.scene.layout)
            physics.after_reset()
            readings = self.definition.read(data)
        self._now.memory = self.definition.begin(self._now.memory, readings)
        self._now.readings = None
        return readings
