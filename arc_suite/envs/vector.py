"""Many environments of one task as one Gymnasium vector environment, on `mujoco.batch`."""

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import gymnasium
import mujoco
import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from arc_suite import checks
from arc_suite.envs import snapshots, stacked, trees
from arc_suite.envs.base_vector import MAX_ENVS, BaseVectorEnv
from arc_suite.envs.calls import (
    KnownAttributes,
    LiveCommands,
    Lock,
    checked_action,
    checked_command,
    one_thread_at_a_time,
)
from arc_suite.envs.prepare import checked_changes, checked_limit, prepare_task
from arc_suite.envs.task_view import TaskView
from arc_suite.robots.spec import Body
from arc_suite.simulation import pictures
from arc_suite.simulation.batch import Batch
from arc_suite.simulation.cores import usable_cores
from arc_suite.simulation.model import checked_fields
from arc_suite.tasks import Task, privileged, terms
from arc_suite.tasks.contract import CURRICULUM, Inputs

_MOST_THREADS = 1 << 10
_RENDER_MODES = ("rgb_array", "depth_array")


class VectorTask(TaskView, KnownAttributes):
    """The task of a vector environment; terms and metrics are (num_envs,)."""

    def __init__(self, environment: "VectorEnv"):
        """View a vector environment that has prepared its task."""
        self._environment, self._made = environment, __name__

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
        """Metrics of the episodes so far by name.

        Raises:
            ResetNeeded: before the first reset.
        """
        return self.definition.progress(self._memory)

    @property
    def privileged(self) -> Mapping[str, np.ndarray]:
        """What no policy observes, (num_envs, size) each, by the names of `definition.privileged_blocks`, now.

        Raises:
            ResetNeeded: before the first reset.
        """
        return self._environment._privileged_blocks(self.definition, self._memory)

    @property
    def _memory(self) -> Any:
        if self._environment._memory is None:
            raise ResetNeeded("no episode has begun; call reset first")
        return self._environment._memory


class VectorEnv(KnownAttributes, BaseVectorEnv):
    """Environments of one task, made by `gymnasium.make_vec("arc_suite/<robot>-<task>-v0", num_envs=n, ...)`.

    An environment seeded s is bit-equal to `arc_suite.envs.gym.Env` seeded s, from step to step and from episode
    to episode, whatever the number of threads. Spaces, observations and infos are that environment's,
    batched as `SyncVectorEnv` does. Arrays handed out are the caller's own.

    A step's info holds the task's unweighted terms, `reward_forward` and so on, and figures of how
    well the episodes have gone so far, such as `progress_speed`: (num_envs,) floats, with
    the mask of the environments that have them under the same name after an underscore.

    Pickles and copies carry on bit for bit. While one thread is in a call, another's is refused, except `command`.

    Where the physics of an environment diverges, its episode is terminated with reward 0 and `info` has
    `diverged`; the others notice nothing.

    Attributes:
        arguments: robot, task and its settings, as `Setup.of` takes them.
        autoreset_mode: what happens to an environment whose episode has ended.
        batch: the simulations. Writing their state is for experiments.
        step_limit: control steps after which every episode is over, may be infinite.
        task: what the environments do; its `split` gives an observation's blocks by name.
    """

    def __init__(
        self,
        domain_name: str | os.PathLike | Body,
        task_name: str,
        num_envs: int = 1,
        num_threads: int | None = None,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        max_episode_steps: int | None = None,
        task_kwargs: Mapping[str, Any] | None = None,
        render_mode: str | None = None,
        width: int = 640,
        height: int = 480,
        camera_id: int | str = "tracking",
        privileged: bool = False,
    ):
        """Load the task and allocate the environments.

        Args:
            domain_name: a robot or another body; see `arc_suite.load`.
            task_name: as in `arc_suite.load`.
            num_envs: number of environments.
            num_threads: on which to simulate; None for as many as this process has cores.
            autoreset_mode: NextStep or SameStep: an environment whose episode has ended starts the next one in
                the step after or at once; Disabled: it rests, with reward 0, until a reset whose
                `reset_mask` has it.
            max_episode_steps: truncates episodes, as `gymnasium.make` does, in addition to the task's time limit.
            task_kwargs: as in `arc_suite.load`; `random=s` seeds environment i with s + i, and
                `on_divergence` can only be "terminate".
            render_mode: None, rgb_array or depth_array (m).
            width: of a picture, pixels.
            height: of a picture, pixels.
            camera_id: a camera's name or index, -1 for a free one.
            privileged: whether infos hold the privileged observations, `privileged` (num_envs, size) float32.

        Raises:
            ValueError: an unknown name, or a value that does not fit.
        """
        self._lock, self.batch = Lock(), None  # first, as Gymnasium closes also what could not be made
        task_kwargs = dict(checks.mapping("task_kwargs", task_kwargs))
        seed = task_kwargs.pop("random", None)
        checks.name(task_kwargs.pop("on_divergence", "terminate"), ["terminate"], "on_divergence of many environments")
        mode = autoreset_mode.value if isinstance(autoreset_mode, AutoresetMode) else autoreset_mode
        modes = [mode.value for mode in AutoresetMode]
        self.autoreset_mode = AutoresetMode(checks.name(mode, modes, "autoreset_mode"))
        if render_mode is not None:
            checks.name(render_mode, _RENDER_MODES, "render_mode")
        self.num_envs = checks.integer("num_envs", num_envs, 1, MAX_ENVS)
        self._tells = checks.boolean("privileged", privileged)
        pictures.check_size(height, width)
        threads = min(usable_cores(), _MOST_THREADS) if num_threads is None else num_threads
        threads = checks.integer("num_threads", threads, 1, _MOST_THREADS)

        self.arguments = domain_name, task_name, task_kwargs
        self._tasks, model = self._prepare_tasks()
        self._task = _one(self._tasks)
        pictures.check_camera(model if isinstance(model, mujoco.MjModel) else model[0], camera_id)
        self.step_limit = self._task.step_limit
        if max_episode_steps is not None:
            limit = checked_limit(max_episode_steps, self._tasks[0])
            self.step_limit = np.minimum(self.step_limit, limit)[()]

        self.batch = Batch(model, self.num_envs, threads, self._task.reads)
        self.task = VectorTask(self)
        self._terms = {}  # of the latest step
        self._memory = None  # of all environments, with a leading axis
        self._commands = LiveCommands()
        self._opened, self._next = list(self._tasks), list(self._tasks)  # tasks as opened, and of the next episodes
        self._changes, self._next_changes = (np.full(self.num_envs, "{}", object) for _ in range(2))  # JSON of settings
        self._randoms = [np.random.RandomState() for _ in range(self.num_envs)]
        self._streams = [task.first() for task in self._tasks]  # states, as the present episodes began
        self._stream_seeds = np.full(self.num_envs, -1)  # Gymnasium's sign for a stream of unknown seed
        self._streams_begin = np.ones(self.num_envs, bool)  # environments whose next episode is the first of its stream
        if seed is not None:
            self._seed(self._checked_seeds(seed), np.ones(self.num_envs, bool))
        self._steps = np.zeros(self.num_envs, int)  # of the present episodes
        self._ended = np.zeros(self.num_envs, bool)  # environments whose episode has ended and whose next has not begun
        self._resting = np.zeros(self.num_envs, bool)

        self.metadata = {
            "render_modes": list(_RENDER_MODES),
            "render_fps": round(1.0 / self._tasks[0].scene.control_timestep),
            "autoreset_mode": self.autoreset_mode,
        }
        self.render_mode = render_mode
        self._picture: dict[str, Any] = {
            "width": width,
            "height": height,
            "camera_id": camera_id,
            "depth": render_mode == "depth_array",
        }
        self._observation = np.zeros((self.num_envs, self._task.size), np.float32)  # the latest
        self.single_observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (self._task.size,), np.float32)
        joints = len(self._tasks[0].scene.body.joint_names)
        self.single_action_space = gymnasium.spaces.Box(-1.0, 1.0, (joints,), np.float32)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._made = __name__

    @one_thread_at_a_time
    def reset(self, *, seed: int | Sequence[int | None] | None = None, options: Mapping[str, Any] | None = None):
        """Start an episode in every environment, or in some.

        Args:
            seed: s to seed environment i with s + i, one seed for each environment, or None to continue their
                streams of random numbers; single seeds may be None, too.
            options: `reset_mask`, (num_envs,) booleans, limits seeding and restart to some environments.

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
            self._seed(self._checked_seeds(seed), mask)
        self._take_commands()
        self._begin(mask, self._observation)
        return self._observation.copy(), self._privileged(mask)

    @one_thread_at_a_time
    def step(self, actions):
        """Advance every environment by one control step, except those that start an episode instead.

        Args:
            actions: (num_envs, motors), clipped to [-1, 1]; ignored for an environment that starts an episode.

        Returns:
            Observations (num_envs, size) float32; rewards (num_envs,); terminated and truncated,
            (num_envs,) booleans; and an info as Gymnasium defines it: `reward_<term>` and
            `progress_<figure>`, of environments that diverged also `diverged`, and in the mode SameStep
            `final_obs` and `final_info` of environments whose episode ended.

        Raises:
            ValueError: actions of another shape, or NaN in one; nothing has moved then.
            ResetNeeded: before the first reset.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("step")
        if self._memory is None:
            raise ResetNeeded("cannot step: no episode has begun; call reset first")
        self._take_commands()
        task, before, data = self._task, self._memory, self.batch.data
        waiting = self._ended & (self.autoreset_mode == AutoresetMode.DISABLED)
        stepping, restarting = ~(self._ended | self._resting), self._ended & ~(self._resting | waiting)
        memory, inputs = task.before(before, checked_action(actions, self.action_space.shape))
        self._write(inputs, stepping)
        diverged = self.batch.step(task.scene.substeps, stepping)
        readings = task.read(data)
        self._memory = memory = trees.where(stepping, task.after(memory, readings), before)
        self._steps += 1

        raw = task.terms(memory, readings)
        if diverged.any():
            raw = {name: np.where(diverged, 0.0, term) for name, term in raw.items()}
        self._terms, reward = terms.reward(raw, task.settings.weights, task.cost_limit)
        reward = np.where(stepping, reward, 0.0)
        observation = task.vector(task.observe(memory, readings), np.float32)
        failed, cut = task.ended(memory, readings)
        time_is_up = self._steps >= task.step_limit
        terminated = stepping & (diverged | failed) & ~time_is_up
        truncated = stepping & ((cut & ~terminated) | time_is_up | (self._steps >= self.step_limit))
        self._ended = waiting | terminated | truncated

        info = {}
        if self.autoreset_mode == AutoresetMode.SAME_STEP and self._ended.any():
            restarting, stepping = self._ended, stepping & ~self._ended
            last = _by_environment(observation, restarting)
            final = {
                "final_obs": last,
                "final_info": self._info(restarting, diverged) | self._privileged(restarting),
            }
            info |= _marked(final, restarting)
        info |= self._info(stepping, diverged)
        if restarting.any():
            self._begin(restarting, observation)
        info |= self._privileged(stepping | restarting)
        self._observation = observation.copy()
        return observation, reward, terminated, truncated, info

    def resampled(self) -> np.ndarray:
        """Return in which environments (num_envs,) the latest step began another command of the schedule.

        The change does not depend on the action, so it adds noise to returns (Mao et al., "Variance reduction for
        reinforcement learning in input-driven environments", 2019). `ppo` bootstraps there from the observation
        before the step. Environments that rest, or whose episode ended or began in the step, have False.
        """
        if self._memory is None:
            return np.zeros(self.num_envs, bool)
        return ~(self._ended | self._resting) & self._task.resampled(self._memory)

    def command(self, name: str, value, mask=None) -> None:
        """Set a command of the task in some environments from the next step on, until their next episodes.

        Any thread may call it while another is in a step, which goes on with the command before.

        Args:
            name: one of the task's `commands`.
            value: (size,) numbers for all environments of the mask, or (num_envs, size), where only rows of
                the mask count; None, or NaN in some, for the task's own command.
            mask: (num_envs,) booleans, the environments that it goes to; None for all.

        Raises:
            ValueError: no such command, or a value or mask that does not fit.
            ResetNeeded: before the first reset.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("command")
        mask, value = self._checked_mask(mask, "mask"), checked_command(self._task, name, value, (self.num_envs,))
        if self._memory is None:
            raise ResetNeeded(f"cannot set command {name!r}: no episode has begun; call reset first")
        self._commands.put(name, value, mask)

    @one_thread_at_a_time
    def change_model(self, fields: Mapping[str, Any], mask=None) -> None:
        """Set fields of the models of some environments from the next step on; they stay over resets.

        What a task would draw of a changed field, as modifiers draw friction and mass, gives way to it.

        Args:
            fields: values by name of `simulation.model.FIELDS`, the fields of `MjModel` and `gravity`: what broadcasts
                to the field's shape, or to that with a leading axis of num_envs.
            mask: (num_envs,) booleans, the environments that it goes to; None for all.

        Raises:
            ValueError: no such field, one without effect, or a value or mask that does not fit.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("change the model")
        mask, fields = self._checked_mask(mask, "mask"), self._checked_fields(fields)
        self.batch.change_model(fields, mask)

    def _checked_fields(self, fields: Any) -> dict[str, np.ndarray]:
        return checked_fields(self.batch.models[0], fields, self.num_envs)

    @one_thread_at_a_time
    def change_settings(self, settings: Mapping[str, Any], mask=None) -> None:
        """Set settings of the task of some environments, from their next reset on.

        They replace values of `task_kwargs` and of earlier calls. What changes the arena, the observation, or whether
        there are kicks and other modifiers is refused. `level` begins the curriculum again at that level.

        Args:
            settings: some of `task_kwargs`.
            mask: (num_envs,) booleans, the environments that it goes to; None for all.

        Raises:
            ValueError: an unknown name, a setting that cannot be changed, or a value or mask that does not fit.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("change settings")
        self._put_changes(self._checked_mask(mask, "mask"), self._checked_changes(settings), CURRICULUM[1] in settings)

    def _checked_changes(self, settings: Any) -> list[tuple[str, Task]]:
        """For each environment, the JSON of its changed settings, and its next task."""
        found: dict[tuple[int, str], tuple[str, Task]] = {}
        keys = [(id(task), text) for task, text in zip(self._opened, self._next_changes, strict=True)]
        for key, task in zip(keys, self._opened, strict=True):
            if key not in found:
                found[key] = checked_changes(task, self.arguments[2], key[1], settings)
                if stacked.kind(task) is None:
                    raise ValueError(f"task {task.name}: without from_body environments cannot differ in settings")
        return [found[key] for key in keys]

    def _put_changes(self, mask: np.ndarray, changes: Sequence[tuple[str, Task]], restart: bool) -> None:
        for index in np.flatnonzero(mask).tolist():
            self._next_changes[index], self._next[index] = changes[index]
        self._streams_begin |= mask & restart

    @one_thread_at_a_time
    def rest(self, mask) -> None:
        """Let environments, and no others, stand still until they are reset; meanwhile they cost next to nothing.

        Args:
            mask: (num_envs,) booleans, at least one of them true.

        Raises:
            ValueError: a mask that does not fit.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("rest")
        self._resting = self._checked_mask(mask, "mask")

    @one_thread_at_a_time
    def snapshot(self) -> dict[str, np.ndarray]:
        """Return the state of all environments as arrays by name, from which `restore` goes on.

        Raises:
            ResetNeeded: before the first reset.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("take a snapshot")
        if self._memory is None:
            raise ResetNeeded("cannot take a snapshot: no episode has begun; call reset first")
        self._take_commands()
        return snapshots.to_arrays(self._state())

    @one_thread_at_a_time
    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Go on, bit-exact, from the snapshot of an environment of the same size and task.

        Raises:
            ValueError: an array is missing or does not fit; none has been used.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("restore")
        self._put(self._checked_snapshot(arrays))

    @one_thread_at_a_time
    def render(self, indices: Iterable[int] | None = None) -> tuple[np.ndarray, ...] | None:
        """Return pictures of the present states, in the mode and size chosen at the start.

        Args:
            indices: of the environments; None for all.

        Returns:
            A picture for each environment. rgb_array: (height, width, 3) uint8. depth_array: (height, width)
            float32, m. None without a render mode.

        Raises:
            ValueError: no such environment.
            RenderingUnavailable: no OpenGL here.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("render")
        if self.render_mode is None:
            return None
        self._take_commands()
        return tuple(self._picture_of(index) for index in self._checked_indices(indices))

    @one_thread_at_a_time
    def close(self, **kwargs) -> None:
        """Free the simulations; once more does nothing.

        Raises:
            RuntimeError: another thread is at work in the environment.
        """
        super().close(**kwargs)

    def close_extras(self, **kwargs) -> None:
        """Free the simulations; `close` calls it."""
        self.batch = None

    @property  # type: ignore[misc]  # of Gymnasium, which can be set and is of one environment
    def np_random(self) -> tuple[np.random.Generator, ...]:
        """Draw, for each environment, from the stream that its resets draw from."""
        return tuple(np.random.Generator(random._bit_generator) for random in self._randoms)

    @property
    def np_random_seed(self) -> tuple[int, ...]:
        """The seed of each environment's stream of random numbers; -1 where none was given."""
        return tuple(self._stream_seeds.tolist())

    def _prepare_tasks(self) -> tuple[list[Task], mujoco.MjModel | list[mujoco.MjModel]]:
        """The task of each environment, and the model of all, or that of each."""
        task, model = prepare_task(*self.arguments)
        return [task] * self.num_envs, model

    def _state(self) -> snapshots.State:
        own = {name: getattr(self, f"_{name}").copy() for name in snapshots.ENVIRONMENT_ARRAYS}
        settings = self._changes.tolist(), self._next_changes.tolist()
        randoms = [random.get_state() for random in self._randoms]
        return snapshots.State(self.batch.snapshot(), self._memory, self._streams, randoms, own, settings)

    def _checked_snapshot(self, arrays: Mapping[str, np.ndarray]) -> tuple[snapshots.State, list[list[Task]]]:
        """A snapshot that fits, and the tasks of its episodes and of the next ones; episodes have begun then."""
        if self._memory is None:
            self._begin(np.ones(self.num_envs, bool), self._observation)
        self._take_commands()
        return snapshots.from_arrays(
            self._state(), self._task, self.batch.checked, arrays, self._opened, self.arguments[2]
        )

    def _put(self, snapshot: tuple[snapshots.State, list[list[Task]]]) -> None:
        state, (self._tasks, self._next) = snapshot
        self.batch.restore(state.simulations)
        self._task, self._memory, self._streams = _one(self._tasks), state.memory, state.streams
        self._changes, self._next_changes = (np.array(texts, object) for texts in state.settings)
        for name, array in state.environment_arrays.items():
            setattr(self, f"_{name}", array)
        for random, each in zip(self._randoms, state.randoms, strict=True):
            random.set_state(each)

    def _take_commands(self) -> None:
        self._memory = self._commands.consume(self._task, self._memory)

    def _picture_of(self, index: int) -> np.ndarray:
        task, scene, shown = self._tasks[index], self._tasks[index].scene, {}
        if self._memory is not None:
            memory = trees.entry(self._memory, index)
            shown["markers"] = task.markers(memory, task.read(self.batch.part(index)))
            shown["failed_legs"] = task.failed_legs(memory)
        qpos, mocap_pos = self.batch.data.qpos[index], self.batch.mocap_pos[index]
        return pictures.picture(scene.body, scene.arena, qpos, mocap_pos=mocap_pos, **shown, **self._picture)

    def _begin(self, mask: np.ndarray, observation: np.ndarray) -> None:
        """Start episodes in some environments, (num_envs,) booleans, and put their observations among the others."""
        starts = []
        for index in np.flatnonzero(mask).tolist():
            own = self._next[index]
            if self._streams_begin[index]:
                self._streams[index] = own.first()
            else:
                self._streams[index] = self._tasks[index].stream_state(trees.entry(self._memory, index))
            starts.append(own.start(self._randoms[index], self._streams[index]))
        self._streams_begin &= ~mask
        self._take_settings(mask)
        qpos, qvel, memories, mocap, models = zip(*starts, strict=True)
        mocap = None if mocap[0] is None else np.stack(mocap)
        self.batch.reset(mask, np.stack(qpos), np.stack(qvel), mocap, models)
        memory, task, part = trees.map_leaves(lambda *fields: np.stack(fields), *memories), self._task, mask
        if task is not self._tasks[0]:  # a stacked one, which takes all environments
            part = np.ones(self.num_envs, bool)
            memory = memory if self._memory is None else _scattered(mask, memory, self._memory)
        readings, begun = task.read(self.batch.part(part)), mask[part]
        lifted = task.clear_spawn(memory, readings)
        if lifted is not None:
            self.batch.place(mask, lifted[begun])
            readings = task.read(self.batch.part(part))
        memory = task.begin(memory, readings)
        observation[mask] = task.vector(task.observe(memory, readings), np.float32)[begun]
        # Before the first step there is nothing to keep, as all environments begin.
        some = memory if begun.all() else trees.map_leaves(lambda leaf: leaf[begun], memory)
        self._memory = memory if self._memory is None else _scattered(mask, some, self._memory)
        self._steps[mask] = 0
        self._ended, self._resting = self._ended & ~mask, self._resting & ~mask

    def _take_settings(self, mask: np.ndarray) -> None:
        """Let changed settings hold in some environments, (num_envs,) booleans."""
        if (changed := mask & (self._changes != self._next_changes)).any():
            self._changes[changed] = self._next_changes[changed]
            pairs = zip(self._tasks, self._next, strict=True)
            self._tasks = [pair[there] for pair, there in zip(pairs, changed.tolist(), strict=True)]
            self._task = _one(self._tasks)

    def _write(self, inputs: Inputs, mask: np.ndarray) -> None:
        """Write what a control step needs into some environments."""
        data = self.batch.data
        np.copyto(data.ctrl[:, : inputs.ctrl.shape[-1]], inputs.ctrl, where=mask[:, None])
        if inputs.kick is not None:
            data.qvel[mask] += inputs.kick[mask]
        if inputs.force is not None:
            self.batch.xfrc_applied[mask, self._task.scene.layout.torso, :3] = inputs.force[mask]

    def _info(self, mask: np.ndarray, diverged: np.ndarray) -> dict[str, Any]:
        """What the latest step tells of some environments."""
        info = {}
        if mask.any():
            metrics = {f"reward_{name}": term for name, term in self._terms.items()}
            metrics |= {f"progress_{name}": metric for name, metric in self._task.progress(self._memory).items()}
            info |= _marked({name: np.where(mask, metric, 0.0) for name, metric in metrics.items()}, mask)
        diverged = diverged & mask
        if diverged.any():
            info |= _marked({"diverged": diverged}, diverged)
        return info

    def _privileged(self, mask: np.ndarray) -> dict[str, np.ndarray]:
        """The privileged observations of some environments, as an info."""
        if not (self._tells and mask.any()):
            return {}
        return _marked({"privileged": np.where(mask[:, None], self._privileged_vectors(), np.float32(0.0))}, mask)

    def _privileged_vectors(self) -> np.ndarray:
        return privileged.vector(self._task, self._privileged_blocks(self._task, self._memory))

    def _privileged_blocks(self, definition: Task, memory: Any) -> dict[str, np.ndarray]:
        """The privileged observations by block; what `change_model` has set holds in place of what was drawn."""
        found = definition.privileged(memory, self.batch.data)
        for index, task in enumerate(self._tasks if self.batch.changed else ()):
            fields = self.batch.lasting(index)
            own = task.read_back({name: block[index] for name, block in found.items()}, fields) if fields else {}
            for name, block in own.items():
                found[name] = found[name].copy()  # of the memory
                found[name][index] = block
        return found

    def _seed(self, seeds: Sequence[int | None], mask: np.ndarray) -> None:
        """Start new streams of random numbers in some environments, except those whose seed is None."""
        for index in np.flatnonzero(mask).tolist():
            if seeds[index] is not None:
                self._randoms[index] = np.random.RandomState(seeds[index])
                self._stream_seeds[index], self._streams_begin[index] = seeds[index], True


def _one(tasks: Sequence[Task]) -> Task:
    """One task for all environments, of the tasks of each."""
    return tasks[0] if all(task is tasks[0] for task in tasks) else stacked.stack_tasks(tasks)


def _scattered(mask: np.ndarray, some, memory):
    """A memory with the values of `some` in the environments of a mask (num_envs,)."""

    def scattered(new, old):
        copied = old.copy()
        copied[mask] = new
        return copied

    return trees.map_leaves(scattered, some, memory)


def _marked(values: Mapping[str, Any], mask: np.ndarray) -> dict[str, Any]:
    """Values by name, and by `_name` the environments that have them, as Gymnasium's infos are."""
    return {key: item for name, value in values.items() for key, item in ((name, value), (f"_{name}", mask.copy()))}


def _by_environment(observations: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Observations of some environments in an array of objects, with None for the others."""
    objects = np.full(len(observations), None, dtype=object)
    for index in np.flatnonzero(mask).tolist():
        objects[index] = observations[index].copy()
    return objects
