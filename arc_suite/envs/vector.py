"""Many environments of one task as one Gymnasium vector environment, on `mujoco.batch`."""

import copy
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Self

import gymnasium
import mujoco
import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike

from arc_suite import checks, usage
from arc_suite.envs import snapshots, stacked, trees
from arc_suite.envs.base_vector import MAX_ENVS, BaseVectorEnv, checked_task_kwargs
from arc_suite.envs.calls import (
    KnownAttributes,
    LiveCommands,
    Lock,
    checked_action,
    checked_command,
    one_thread_at_a_time,
)
from arc_suite.envs.prepare import checked_changes, checked_limit, prepare_task, refuse_arguments, stored_settings
from arc_suite.envs.task_view import TaskView
from arc_suite.robots.spec import Body
from arc_suite.simulation import pictures
from arc_suite.simulation.batch import Batch
from arc_suite.simulation.cores import usable_cores
from arc_suite.simulation.model import check_fields
from arc_suite.tasks import Task, privileged, terms
from arc_suite.tasks.contract import LEVEL, Inputs
from arc_suite.tasks.readings import root_qpos, root_qvel
from arc_suite.tasks.scene import Start

_MAX_THREADS = 1 << 10
_RENDER_MODES = ("rgb_array", "depth_array")


class VectorTask(TaskView, KnownAttributes):
    """The task of a vector environment; terms and metrics are (num_envs,)."""

    def __init__(self, environment: "VectorEnv"):
        """View the task of a vector environment, which it has prepared."""
        self._environment = environment
        self._sealed_by = __name__

    @property
    def definition(self) -> Task:
        """The task, a value of the contract."""
        return self._environment._task

    @property
    def terms(self) -> Mapping[str, np.ndarray]:
        """Unweighted terms of the latest step by name."""
        return self._environment._terms

    @property
    def progress(self) -> Mapping[str, np.ndarray]:
        """How well the episodes have gone so far, metrics by name.

        Raises:
            ResetNeeded: before the first reset.
        """
        self._check_begun()
        return self.definition.progress(self._environment._memory)

    @property
    def privileged(self) -> Mapping[str, np.ndarray]:
        """The present privileged observations, (num_envs, size) each, by the names of `definition.privileged_blocks`.

        Raises:
            ResetNeeded: before the first reset.
            ClosedEnvironmentError: after `close`.
        """
        self._environment._check_open("read privileged observations")
        self._check_begun()
        return self._environment._privileged_blocks()

    def _check_begun(self) -> None:
        """Raise ResetNeeded before the first reset."""
        if self._environment._memory is None:
            raise ResetNeeded("no episode has begun; call reset first")


class VectorEnv(KnownAttributes, BaseVectorEnv):
    """Environments of one task, made by `gymnasium.make_vec("arc_suite/<robot>-<task>-v0", num_envs=n, ...)`.

    An environment with seed s is bit-equal to `arc_suite.envs.gym.Env` with seed s, in all steps and
    episodes, for any number of threads. Spaces, observations and infos are those of that environment,
    batched as `SyncVectorEnv` does. The environment keeps no references to arrays that it returns.

    A step's info contains the task's unweighted terms, `reward_forward` and so on, and metrics of how
    well the episodes have gone so far, such as `progress_speed`: (num_envs,) floats. The mask of the
    environments that have an entry is in the info under the same name after an underscore.

    Pickles and copies continue bit for bit. While one thread is in a call, calls of other threads raise RuntimeError,
    except `command`.

    If the physics of an environment diverges, its episode is truncated with reward 0 and `info` has
    `diverged`; this has no effect on the other environments.

    Attributes:
        arguments: robot, task and its settings, as `Setup.of` takes them.
        autoreset_mode: what happens to an environment whose episode has ended.
        batch: the simulations; None after `close`. Writing their state is for experiments.
        step_limit: control steps after which every episode is over, may be infinite.
        task: the task of the environments; its `split` returns an observation's blocks by name.
    """

    observation_space: gymnasium.spaces.Box
    action_space: gymnasium.spaces.Box
    single_observation_space: gymnasium.spaces.Box
    single_action_space: gymnasium.spaces.Box

    _max_episode_steps: float = math.inf  # in pickles of earlier versions, which have `step_limit` alone

    _FORMER_NAMES = {  # in pickles of earlier versions
        **KnownAttributes._FORMER_NAMES,
        "_tells": "_has_privileged_info",
        "_opened": "_opened_tasks",
        "_next": "_next_tasks",
        "_picture": "_picture_options",
    }

    def __init__(
        self,
        domain_name: str | os.PathLike[str] | Body,
        task_name: str,
        num_envs: int = 1,
        num_threads: int | None = None,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        max_episode_steps: int | None = None,
        task_kwargs: Mapping[str, Any] | None = None,
        render_mode: str | None = None,
        width: int | None = None,
        height: int | None = None,
        camera_id: int | str | None = None,
        privileged: bool = False,
        **others: Any,
    ):
        """Load the task and allocate the environments.

        Args:
            domain_name: a robot or another body; see `arc_suite.load`.
            task_name: as in `arc_suite.load`.
            num_envs: number of environments.
            num_threads: number of threads that simulate; None for one for each core that this process may use.
            autoreset_mode: when an environment whose episode has ended starts the next one: NextStep, in the next
                step; SameStep, at once; Disabled, in a reset whose `reset_mask` has it, and until then it rests with
                reward 0.
            max_episode_steps: control steps after which an episode is truncated; None for the task's limit.
            task_kwargs: as in `arc_suite.load`; `random=s` seeds environment i with s + i, and
                `on_divergence` can only be "truncate".
            render_mode: None, rgb_array or depth_array (m).
            width: width of a picture, pixels; only with a render mode, as the next two.
            height: height of a picture, pixels.
            camera_id: a camera's name or index, -1 for a free one.
            privileged: whether infos contain the privileged observations, `privileged` (num_envs, size) float32.
            **others: none; they are refused with what takes their place.

        Raises:
            ValueError: an unknown name, or a value that does not fit.
        """
        # Set first, as Gymnasium also closes an environment whose `__init__` has raised.
        self._lock = Lock()
        self.batch = None
        refuse_arguments(others, type(self).__init__, task_name)

        task_kwargs = dict(checked_task_kwargs(task_kwargs))
        seed = task_kwargs.pop("random", None)
        checks.name(task_kwargs.pop("on_divergence", "truncate"), ["truncate"], "on_divergence of many environments")
        self.autoreset_mode = _checked_autoreset_mode(autoreset_mode)
        if render_mode is not None:
            checks.name(render_mode, _RENDER_MODES, "render_mode")
        self.num_envs = checks.integer("num_envs", num_envs, 1, MAX_ENVS)
        self._has_privileged_info = checks.boolean("privileged", privileged)
        picture_options = pictures.options(render_mode, width, height, camera_id)
        threads = min(usable_cores(), _MAX_THREADS) if num_threads is None else num_threads
        threads = checks.integer("num_threads", threads, 1, _MAX_THREADS)

        self.arguments = domain_name, task_name, task_kwargs
        self._tasks, model = self._prepare_tasks()
        self.arguments = domain_name, task_name, stored_settings(self._tasks[0], task_kwargs)
        self._task = _join_tasks(self._tasks)
        any_model = model if isinstance(model, mujoco.MjModel) else model[0]
        pictures.check_camera(any_model, picture_options["camera_id"])
        self._max_episode_steps = math.inf
        if max_episode_steps is not None:
            self._max_episode_steps = checked_limit(max_episode_steps, self._tasks[0])
        self.step_limit = np.minimum(self._task.step_limit, self._max_episode_steps)

        self.batch = Batch(model, self.num_envs, threads, self._task.reads)
        self.task = VectorTask(self)
        self._terms = {}  # of the latest step
        self._memory = None  # of all environments, with a leading axis; None before the first reset
        self._commands = LiveCommands()
        # Tasks of each environment with the settings with which it was opened, and with those of the next episodes.
        self._opened_tasks = list(self._tasks)
        self._next_tasks = list(self._tasks)
        # JSON of the changed settings of each environment: in the present episodes, and in the next ones.
        self._changes = np.full(self.num_envs, "{}", object)
        self._next_changes = np.full(self.num_envs, "{}", object)
        self._randoms = [np.random.RandomState() for _ in range(self.num_envs)]
        self._streams = [task.first() for task in self._tasks]  # states with which the present episodes have started
        self._stream_seeds = np.full(self.num_envs, usage.UNKNOWN_SEED)
        self._streams_begin = np.ones(self.num_envs, bool)  # environments whose next episode is the first of its stream
        if seed is not None:
            self._begin_streams(self._checked_seeds(seed), np.ones(self.num_envs, bool))
        self._steps = np.zeros(self.num_envs, int)  # of the present episodes
        self._ended = np.zeros(self.num_envs, bool)  # environments between the end of an episode and the next start
        self._resting = np.zeros(self.num_envs, bool)  # environments that stand still; see `rest`

        self.metadata = {
            "render_modes": list(_RENDER_MODES),
            "render_fps": round(1.0 / self._tasks[0].scene.control_timestep),
            "autoreset_mode": self.autoreset_mode,
        }
        self.render_mode = render_mode
        self._picture_options: dict[str, Any] = {**picture_options, "depth": render_mode == "depth_array"}
        self._observation = np.zeros((self.num_envs, self._task.size), np.float32)  # the latest
        self.single_observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (self._task.size,), np.float32)
        joints = len(self._tasks[0].scene.body.joint_names)
        self.single_action_space = gymnasium.spaces.Box(-1.0, 1.0, (joints,), np.float32)
        # Batches of a Box are a Box.
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)  # type: ignore[assignment]
        self.action_space = batch_space(self.single_action_space, self.num_envs)  # type: ignore[assignment]
        self._sealed_by = __name__

    @one_thread_at_a_time
    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Start an episode in every environment, or in some.

        Args:
            seed: s to seed environment i with s + i, one seed for each environment, or None to continue their
                streams of random numbers; single seeds may be None, too. While a run learns, streams of unknown seeds
                end, and new ones begin with seeds of the run.
            options: `reset_mask`, (num_envs,) booleans, selects the environments that get seeds and start.

        Returns:
            Observations (num_envs, size) float32 of all environments, and an info that is empty or has `privileged`.

        Raises:
            ValueError: a seed or mask that does not fit.
            ResetNeeded: a mask before every environment has been reset once.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("reset")
        mask = self._checked_reset_mask(options)
        if self._memory is None and not mask.all():
            raise ResetNeeded("cannot reset some environments: reset all of them first")
        if seed is not None:
            self._begin_streams(self._checked_seeds(seed), mask)
        if usage.recording:
            self._begin_unknown_streams(mask)
        self._consume_commands()
        self._start_episodes(mask, self._observation)
        return self._observation.copy(), self._privileged_info(mask)

    @one_thread_at_a_time
    def step(self, actions: ArrayLike) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Advance every environment by one control step, except those that start an episode instead.

        Args:
            actions: (num_envs, motors), clipped to [-1, 1]; ignored for an environment that starts an episode.

        Returns:
            Observations (num_envs, size) float32; rewards (num_envs,); terminated and truncated,
            (num_envs,) booleans; and an info as Gymnasium defines it. It has `reward_<term>` and
            `progress_<metric>`, for environments that diverged also `diverged`, and in the mode SameStep
            `final_obs` and `final_info` for environments whose episode has ended.

        Raises:
            ValueError: actions of another shape, or NaN in one; nothing has moved then.
            ResetNeeded: before the first reset.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("step")
        if self._memory is None:
            raise ResetNeeded("cannot step: no episode has begun; call reset first")
        self._consume_commands()
        task = self._task
        earlier_memory = self._memory
        # What each environment does in this step, (num_envs,) booleans: wait for a reset, move, or start an episode.
        must_wait = self._ended & (self.autoreset_mode == AutoresetMode.DISABLED)
        is_stepping = ~(self._ended | self._resting)
        is_starting = self._ended & ~(self._resting | must_wait)

        memory_with_action, inputs = task.before(earlier_memory, checked_action(actions, self.action_space.shape))
        self._write_inputs(inputs, is_stepping)
        if usage.recording:
            usage.check_seeds(self._stream_seeds[is_stepping].tolist())
            usage.count_steps(int(np.count_nonzero(is_stepping)))
        has_diverged = self.batch.step(task.scene.substeps, is_stepping)
        readings = task.read(self.batch.data)
        has_moved = is_stepping & ~has_diverged  # a step that diverges leaves no trace in metrics and curriculum
        memory = trees.where(has_moved, task.after(memory_with_action, readings), earlier_memory)
        self._memory = memory
        self._steps += is_stepping

        raw_terms = task.terms(memory, readings)
        if has_diverged.any():
            raw_terms = {name: np.where(has_diverged, 0.0, term) for name, term in raw_terms.items()}
        self._terms, reward = terms.reward(raw_terms, task.settings.weights, task.cost_limit)
        reward = np.where(is_stepping, reward, 0.0)
        observation = task.vector(task.observe(memory, readings), np.float32)
        has_failed, is_cut_off = task.ended(memory, readings)
        terminated = is_stepping & has_failed & ~has_diverged
        is_cut_off = is_cut_off | has_diverged | (self._steps >= self.step_limit)
        # At the limit of `max_episode_steps` a fall is both, as by Gymnasium's `TimeLimit`.
        truncated = is_stepping & ((is_cut_off & ~terminated) | (self._steps >= self._max_episode_steps))
        is_ending = terminated | truncated
        self._ended = self._ended | is_ending  # a start takes the mark away

        info = {}
        has_step_info = is_stepping  # environments whose terms and metrics are in the info itself
        if self.autoreset_mode == AutoresetMode.SAME_STEP and is_ending.any():
            has_step_info = is_stepping & ~is_ending
            final_info = self._step_info(is_ending, has_diverged) | self._privileged_info(is_ending)
            final = {"final_obs": _to_objects(observation, is_ending), "final_info": final_info}
            info |= _with_masks(final, is_ending)
            is_starting = is_starting | is_ending  # a snapshot of another mode has ends that wait for a start
        info |= self._step_info(has_step_info, has_diverged)
        if is_starting.any():
            self._start_episodes(is_starting, observation)
        info |= self._privileged_info(has_step_info | is_starting)
        self._observation = observation.copy()
        return observation, reward, terminated, truncated, info

    def resampled(self) -> np.ndarray:
        """Return whether the latest step began another command of the schedule, (num_envs,) booleans.

        The change does not depend on the action, so it adds noise to returns (Mao et al., "Variance reduction for
        reinforcement learning in input-driven environments", 2019). In these environments `ppo` bootstraps from the
        observation before the step. Environments that rest, or whose episode ended or began in the step, have False.
        """
        if self._memory is None:
            return np.zeros(self.num_envs, bool)
        return ~(self._ended | self._resting) & self._task.resampled(self._memory)

    def command(self, name: str, value, mask=None) -> None:
        """Set a command of the task in some environments from the next step on, until their next episodes.

        Any thread may call it while another is in a step, which still uses the earlier command.

        Args:
            name: one of the task's `commands`.
            value: (size,) numbers for all environments of the mask, or (num_envs, size), of which those of environments
                outside the mask are ignored. None and NaN leave the command, or some of its numbers, to the task.
            mask: (num_envs,) booleans, the environments that get the command; None for all.

        Raises:
            ValueError: an unknown command, or a value or mask that does not fit.
            ResetNeeded: before the first reset.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("command")
        mask = self._checked_mask(mask, "mask")
        value = checked_command(self._task, name, value, (self.num_envs,))
        if self._memory is None:
            raise ResetNeeded(f"cannot set command {name!r}: no episode has begun; call reset first")
        self._commands.put(name, value, mask)

    @one_thread_at_a_time
    def change_model(self, fields: Mapping[str, Any], mask=None) -> None:
        """Set fields of the models of some environments from the next step on. Resets do not undo it.

        Modifiers draw friction, mass and other fields for each episode. A field that was set here keeps its value.

        Args:
            fields: values by name. A name is one of `simulation.model.FIELDS`, which are fields of `MjModel` and
                `gravity`, or of `CONTACT_PROPERTIES`: friction, solref, solimp or margin of all contacts. A value
                must broadcast to the shape of the field or property, or to it with a leading axis of num_envs.
            mask: (num_envs,) booleans, the environments whose models change; None for all.

        Raises:
            ValueError: an unknown field, one without effect, or a value or mask that does not fit.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("change the model")
        mask = self._checked_mask(mask, "mask")
        self.batch.change_model(self._checked_fields(fields), mask)

    def _checked_fields(self, fields: Any) -> dict[str, np.ndarray]:
        return check_fields(self.batch.models[0], fields, self.num_envs, self.batch.compiled_field)

    @one_thread_at_a_time
    def change_settings(self, settings: Mapping[str, Any], mask=None) -> None:
        """Set settings of the task of some environments, from their next reset on.

        They replace values of `task_kwargs` and of earlier calls. A setting is refused if it would change the arena,
        the observation, or the presence of a curriculum, of kicks or of other modifiers. `level` restarts the
        curriculum at that level.

        Args:
            settings: some of `task_kwargs`.
            mask: (num_envs,) booleans, the environments whose settings change; None for all.

        Raises:
            ValueError: an unknown name, a setting that cannot be changed, or a value or mask that does not fit.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("change settings")
        mask = self._checked_mask(mask, "mask")
        self._put_changes(mask, self._checked_changes(settings), restart=LEVEL in settings)

    def _checked_changes(self, settings: Any) -> list[tuple[str, Task]]:
        """Return for each environment the JSON of all changed settings, and the task with them."""
        _, _, task_kwargs = self.arguments
        known_changes: dict[tuple[int, str], tuple[str, Task]] = {}  # equal changes of one task give one task
        changes = []
        for opened_task, earlier_changes in zip(self._opened_tasks, self._next_changes, strict=True):
            key = (id(opened_task), earlier_changes)
            if key not in known_changes:
                known_changes[key] = checked_changes(opened_task, task_kwargs, earlier_changes, settings)
                if stacked.kind(opened_task) is None:
                    raise ValueError(
                        f"task {opened_task.name}: without from_body environments cannot differ in settings"
                    )
            changes.append(known_changes[key])
        return changes

    def _put_changes(self, mask: np.ndarray, changes: Sequence[tuple[str, Task]], restart: bool) -> None:
        """Change the settings of the next episodes of some environments.

        Args:
            mask: (num_envs,) booleans, the environments.
            changes: changes of each environment, JSON of all changed settings and the task with them.
            restart: whether the next episodes start as the first ones of a stream.
        """
        for index in np.flatnonzero(mask).tolist():
            self._next_changes[index], self._next_tasks[index] = changes[index]
        self._streams_begin |= mask & restart

    @one_thread_at_a_time
    def rest(self, mask) -> None:
        """Let some environments stand still until they are reset, and no others. They are not simulated meanwhile.

        Args:
            mask: (num_envs,) booleans, the environments that stand still; at least one of them is true.

        Raises:
            ValueError: a mask that does not fit.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("rest")
        self._resting = self._checked_mask(mask, "mask")

    @one_thread_at_a_time
    def snapshot(self) -> dict[str, np.ndarray]:
        """Return the state of all environments as arrays by name, for `restore`.

        Raises:
            ResetNeeded: before the first reset.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("take a snapshot")
        if self._memory is None:
            raise ResetNeeded("cannot take a snapshot: no episode has begun; call reset first")
        self._consume_commands()
        return snapshots.to_arrays(self._state(), self._opened_tasks)

    @one_thread_at_a_time
    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Continue, bit-exactly, from the snapshot of an environment of the same num_envs and task.

        Raises:
            ValueError: an array is missing or does not fit; the state has not changed.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("restore")
        self._restore_state(*self._checked_snapshot(arrays))

    @one_thread_at_a_time
    def render(self, indices: Iterable[int] | None = None) -> tuple[np.ndarray, ...] | None:
        """Return pictures of the present states, in the mode and size that were chosen at the start.

        Args:
            indices: indices of the environments; None for all.

        Returns:
            A picture for each environment: in the mode rgb_array (height, width, 3) uint8, in depth_array
            (height, width) float32, m. None without a render mode.

        Raises:
            ValueError: an index of no environment.
            RenderingUnavailable: no OpenGL here.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("render")
        if self.render_mode is None:
            return None
        self._consume_commands()
        return tuple(self._picture_of(index) for index in self._checked_indices(indices))

    @one_thread_at_a_time
    def close(self, **kwargs: Any) -> None:
        """Free the simulations; a second call does nothing.

        Raises:
            RuntimeError: another thread is at work in the environment.
        """
        super().close(**kwargs)

    def close_extras(self, **kwargs: Any) -> None:
        """Free the simulations; `close` calls it."""
        self.batch = None

    def _check_process(self) -> None:
        self.batch.check_process()

    @property  # type: ignore[misc]  # Gymnasium's own has a setter, and is a single generator
    def np_random(self) -> tuple[np.random.Generator, ...]:
        """For each environment, a generator of the stream of random numbers from which its resets draw."""
        return tuple(np.random.Generator(random._bit_generator) for random in self._randoms)

    @property
    def np_random_seed(self) -> tuple[int, ...]:
        """The seed of each environment's stream of random numbers; -1 if it is unknown."""
        return tuple(self._stream_seeds.tolist())

    def _prepare_tasks(self) -> tuple[list[Task], mujoco.MjModel | list[mujoco.MjModel]]:
        """Return the task of each environment, and one model for all or a list of one for each."""
        task, model = prepare_task(*self.arguments)
        return [task] * self.num_envs, model

    def _state(self) -> snapshots.State:
        return snapshots.State(
            simulations=self.batch.snapshot(),
            memory=self._memory,
            streams=self._streams,
            randoms=[random.get_state() for random in self._randoms],
            environment_arrays={name: getattr(self, f"_{name}").copy() for name in snapshots.ENVIRONMENT_ARRAYS},
            settings=(self._changes.tolist(), self._next_changes.tolist()),
        )

    def _checked_snapshot(self, arrays: Mapping[str, np.ndarray]) -> tuple[snapshots.State, list[list[Task]]]:
        """Return the state of a snapshot, and the tasks of its episodes and of the next ones.

        Raises:
            ValueError: an array that does not fit, or a seed that the run that learns may not play.
        """
        self._consume_commands()
        _, _, task_kwargs = self.arguments
        begun = self._begun()
        state, tasks = snapshots.from_arrays(
            begun._state(), begun._task, self.batch.check_snapshot, arrays, self._opened_tasks, task_kwargs
        )
        usage.check_seeds(state.environment_arrays["stream_seeds"].tolist())
        return state, tasks

    def _begun(self) -> Self:
        """Return these environments if episodes have begun; else a copy in which they have, as a snapshot has."""
        if self._memory is not None:
            return self
        begun_copy = copy.deepcopy(self)
        begun_copy._start_episodes(np.ones(self.num_envs, bool), begun_copy._observation)
        return begun_copy

    def _restore_state(self, state: snapshots.State, tasks: list[list[Task]]) -> None:
        """Continue from a state, given the tasks of its episodes and of the next ones."""
        self.batch.restore(state.simulations)
        self._tasks, self._next_tasks = tasks
        self._task = _join_tasks(self._tasks)
        self._memory = state.memory
        self._terms = {}
        self._streams = state.streams
        present_changes, next_changes = state.settings
        self._changes = np.array(present_changes, object)
        self._next_changes = np.array(next_changes, object)
        for name, array in state.environment_arrays.items():
            setattr(self, f"_{name}", array)
        for random, random_state in zip(self._randoms, state.randoms, strict=True):
            random.set_state(random_state)

    def _consume_commands(self) -> None:
        """Put the live commands into the memory."""
        self._memory = self._commands.consume(self._task, self._memory)

    def _picture_of(self, index: int) -> np.ndarray:
        """Return a picture of an environment."""
        task = self._tasks[index]
        details = {}  # of the episode, if one has begun
        if self._memory is not None:
            memory = trees.entry(self._memory, index)
            details["markers"] = task.markers(memory, task.read(self.batch.part(index)))
            details["failed_legs"] = task.failed_legs(memory)
        return pictures.picture(
            task.scene.body,
            task.scene.arena,
            self.batch.data.qpos[index],
            mocap_pos=self.batch.mocap_pos[index],
            **details,
            **self._picture_options,
        )

    def _start_episodes(self, mask: np.ndarray, observation: np.ndarray) -> None:
        """Start episodes in some environments, and write their first observations.

        Args:
            mask: (num_envs,) booleans, the environments.
            observation: (num_envs, size) observation of all environments; changed in place.
        """
        starts = [self._draw_start(index) for index in np.flatnonzero(mask).tolist()]
        self._streams_begin &= ~mask
        self._take_over_settings(mask)
        self._reset_simulations(mask, starts)
        memory = trees.map_leaves(lambda *leaves: np.stack(leaves), *(start.memory for start in starts))
        memory, observation[mask] = self._begin_memory(mask, memory)
        if self._memory is None:  # in the first reset, in which all environments start
            self._memory = memory
        else:
            self._memory = _replace_entries(self._memory, mask, memory)
        self._steps[mask] = 0
        self._ended = self._ended & ~mask
        self._resting = self._resting & ~mask

    def _reset_simulations(self, mask: np.ndarray, starts: Sequence[Start]) -> None:
        """Put the simulations of some environments (num_envs,) into their starts, one for each."""
        layout = self._task.scene.layout
        qpos = root_qpos(np.stack([start.qpos for start in starts]), layout)
        qvel = root_qvel(np.stack([start.qvel for start in starts]), qpos, layout)
        has_mocap = starts[0].mocap_pos is not None  # the same for all environments
        mocap_pos = np.stack([start.mocap_pos for start in starts]) if has_mocap else None
        self.batch.reset(mask, qpos, qvel, mocap_pos, [start.model for start in starts])

    def _begin_memory(self, mask: np.ndarray, memory) -> tuple[Any, np.ndarray]:
        """Let the task begin episodes in some environments, whose simulations are reset.

        A task that is the same for all environments gets those of the mask alone. A stacked task needs all of them.

        Args:
            mask: (num_envs,) booleans, the environments.
            memory: memory of their starts.

        Returns:
            Their memory, and their observations (n, size).
        """
        task = self._task
        task_mask = mask  # (num_envs,) the environments that the task gets
        is_stacked = task is not self._tasks[0]
        if is_stacked:
            task_mask = np.ones(self.num_envs, bool)
            if self._memory is not None:
                memory = _replace_entries(self._memory, mask, memory)
        is_starting = mask[task_mask]  # which environments of the task start an episode

        readings = task.read(self.batch.part(task_mask))
        clear_qpos = task.clear_spawn(memory, readings)
        if clear_qpos is not None:
            self.batch.place(mask, root_qpos(clear_qpos[is_starting], task.scene.layout))
            readings = task.read(self.batch.part(task_mask))
        memory = task.begin(memory, readings)
        observation = task.vector(task.observe(memory, readings), np.float32)[is_starting]
        if not is_starting.all():
            memory = trees.map_leaves(lambda leaf: leaf[is_starting], memory)
        return memory, observation

    def _draw_start(self, index: int) -> Start:
        """Return the `Start` of an environment's next episode."""
        next_task = self._next_tasks[index]
        if self._streams_begin[index]:
            self._streams[index] = next_task.first()
        else:
            self._streams[index] = self._tasks[index].stream_state(trees.entry(self._memory, index))
        return next_task.start(self._randoms[index], self._streams[index])

    def _take_over_settings(self, mask: np.ndarray) -> None:
        """Make the settings of the next episodes those of the present ones in some environments (num_envs,)."""
        is_changing = mask & (self._changes != self._next_changes)
        if is_changing.any():
            self._changes[is_changing] = self._next_changes[is_changing]
            tasks = list(self._tasks)
            for index in np.flatnonzero(is_changing).tolist():
                tasks[index] = self._next_tasks[index]
            self._tasks = tasks
            self._task = _join_tasks(self._tasks)

    def _write_inputs(self, inputs: Inputs, mask: np.ndarray) -> None:
        """Write the inputs of a control step into the simulations of some environments (num_envs,)."""
        data = self.batch.data
        np.copyto(data.ctrl[:, : inputs.ctrl.shape[-1]], inputs.ctrl, where=mask[:, None])
        if inputs.kick is not None:
            data.qvel[mask, : inputs.kick.shape[-1]] += inputs.kick[mask]
        if inputs.force is not None:
            self.batch.xfrc_applied[mask, self._task.scene.layout.torso, :3] = inputs.force[mask]

    def _step_info(self, mask: np.ndarray, has_diverged: np.ndarray) -> dict[str, Any]:
        """Return the info of the latest step for some environments (num_envs,)."""
        info = {}
        if mask.any():
            metrics = {f"reward_{name}": term for name, term in self._terms.items()}
            metrics |= {f"progress_{name}": metric for name, metric in self._task.progress(self._memory).items()}
            info |= _with_masks({name: np.where(mask, metric, 0.0) for name, metric in metrics.items()}, mask)
        diverged = has_diverged & mask
        if diverged.any():
            info |= _with_masks({"diverged": diverged}, diverged)
        return info

    def _privileged_info(self, mask: np.ndarray) -> dict[str, np.ndarray]:
        """Return the part of an info with the privileged observations of some environments (num_envs,).

        It is empty unless they were asked for.
        """
        if not (self._has_privileged_info and mask.any()):
            return {}
        vectors = np.where(mask[:, None], self._privileged_vectors(), np.float32(0.0))
        return _with_masks({"privileged": vectors}, mask)

    def _privileged_vectors(self) -> np.ndarray:
        """Return the present privileged observations (num_envs, size) float32."""
        return privileged.vector(self._task, self._privileged_blocks())

    def _privileged_blocks(self) -> dict[str, np.ndarray]:
        """Return the privileged observations by block, with what `change_model` has set in place of what was drawn."""
        blocks = self._task.privileged(self._memory, self.batch.data)
        if not self.batch.changed:
            return blocks
        for index, task in enumerate(self._tasks):
            changed_fields = self.batch.lasting_fields(index)
            if not changed_fields:
                continue
            drawn_blocks = {name: block[index] for name, block in blocks.items()}
            for name, changed_block in task.read_back(drawn_blocks, changed_fields).items():
                blocks[name] = blocks[name].copy()  # it may be an array of the memory
                blocks[name][index] = changed_block
        return blocks

    def _begin_streams(self, seeds: Sequence[int | None], mask: np.ndarray) -> None:
        """Start new streams of random numbers in some environments (num_envs,), except those whose seed is None."""
        seeds_by_index = {index: seeds[index] for index in np.flatnonzero(mask).tolist() if seeds[index] is not None}
        usage.check_seeds(seeds_by_index.values())
        for index, seed in seeds_by_index.items():
            self._randoms[index] = np.random.RandomState(seed)
            self._stream_seeds[index] = seed
            self._streams_begin[index] = True

    def _begin_unknown_streams(self, mask: np.ndarray) -> None:
        """Start streams of the run that learns where some environments (num_envs,) have streams of unknown seeds."""
        is_unknown = mask & (self._stream_seeds == usage.UNKNOWN_SEED)
        if not is_unknown.any():
            return
        drawn_seeds = usage.draw_seeds(int(np.count_nonzero(is_unknown)))
        if drawn_seeds:
            seeds = np.full(self.num_envs, None, object)
            seeds[is_unknown] = drawn_seeds
            self._begin_streams(seeds.tolist(), is_unknown)


def _checked_autoreset_mode(autoreset_mode: str | AutoresetMode) -> AutoresetMode:
    """Return a mode, given the mode or its value.

    Raises:
        ValueError: there is no such mode.
    """
    name = autoreset_mode.value if isinstance(autoreset_mode, AutoresetMode) else autoreset_mode
    valid_names = [mode.value for mode in AutoresetMode]
    return AutoresetMode(checks.name(name, valid_names, "autoreset_mode"))


def _join_tasks(tasks: Sequence[Task]) -> Task:
    """Return one task for all environments, given the task of each."""
    if all(task is tasks[0] for task in tasks):
        return tasks[0]
    return stacked.stack_tasks(tasks)


def _replace_entries(memory, mask: np.ndarray, entries):
    """Return a memory with other entries in the environments of a mask.

    Args:
        memory: memory of all environments.
        mask: (num_envs,) booleans.
        entries: memory of the environments of the mask alone.
    """

    def replace_in_leaf(leaf, leaf_entries):
        changed_leaf = leaf.copy()
        changed_leaf[mask] = leaf_entries
        return changed_leaf

    return trees.map_leaves(replace_in_leaf, memory, entries)


def _with_masks(values: Mapping[str, Any], mask: np.ndarray) -> dict[str, Any]:
    """Return values by name, and by `_name` the mask of the environments that have them, as in Gymnasium's infos."""
    info = {}
    for name, value in values.items():
        info[name] = value
        info[f"_{name}"] = mask.copy()
    return info


def _to_objects(observations: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Return the observations of some environments in an array of objects, with None for the other environments."""
    objects = np.full(len(observations), None, dtype=object)
    for index in np.flatnonzero(mask).tolist():
        objects[index] = observations[index].copy()
    return objects
