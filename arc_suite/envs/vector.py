"""Many environments of one task as one Gymnasium vector environment, on `mujoco.batch`."""

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import ClosedEnvironmentError, ResetNeeded
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from arc_suite import checks
from arc_suite.envs import snapshots
from arc_suite.envs.lock import Lock, one_thread_at_a_time
from arc_suite.envs.prepare import checked_action, checked_command, prepared
from arc_suite.models.sizing import SUBSTEPS
from arc_suite.simulation import pictures
from arc_suite.simulation.batch import Batch
from arc_suite.tasks import terms

_RENDER_MODES = ("rgb_array", "depth_array")
_OF_EACH_ROW = ("np_random", "np_random_seed", "render")  # attributes that have a value for each row already
_OF_ONE_ROW = {"observation_space": "single_observation_space", "action_space": "single_action_space"}


class VectorEnv(gymnasium.vector.VectorEnv):
    """Rows of one task, made by `gymnasium.make_vec("arc_suite/<robot>-<task>-v0", num_envs=n, ...)`.

    A row seeded s is bit-equal to `arc_suite.envs.gym.Env` seeded s, from step to step and from episode
    to episode, whatever the number of threads. Spaces, observations and infos are that environment's,
    batched as `SyncVectorEnv` does. Arrays handed out are the caller's own.

    A step's info holds the task's unweighted terms, `reward_forward` and so on, and figures of how
    well the episodes have gone so far, such as `progress_speed`: (num_envs,) floats, with
    the mask of the rows that have them under the same name after an underscore.

    Pickles and copies carry on bit for bit. While one thread is in a call, another's is refused.

    Where a row's physics diverges, the row's episode is terminated with reward 0 and `info` has
    `diverged`; the other rows notice nothing.

    Attributes:
        autoreset_mode: what happens to a row whose episode has ended.
        batch: the simulations. Writing their state is for experiments.
        task: what the rows do; its `split` gives an observation's blocks by name.
    """

    def __init__(
        self,
        domain_name: str,
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
    ):
        """Load the task and allocates the rows.

        Args:
            domain_name: a robot; see `arc_suite.load`.
            task_name: as in `arc_suite.load`.
            num_envs: number of rows.
            num_threads: on which to simulate; None for as many as this process has cores.
            autoreset_mode: NextStep or SameStep: a row whose episode has ended starts the next one in
                the step after or at once; Disabled: it rests, with reward 0, until a reset whose
                `reset_mask` has it.
            max_episode_steps: truncates episodes, as `gymnasium.make` does, beside the task's time limit.
            task_kwargs: as in `arc_suite.load`; `random=s` seeds row i with s + i, and
                `on_divergence` can only be "terminate".
            render_mode: None, rgb_array or depth_array (m).
            width: of a picture, pixels.
            height: of a picture, pixels.
            camera_id: a camera's name or index, -1 for a free one.

        Raises:
            ValueError: an unknown name, or a value that does not fit; one line that names it and the
                nearest valid name.
        """
        self._lock, self.batch = Lock(), None  # first, as Gymnasium closes also what could not be made
        task_kwargs = dict(task_kwargs or {})
        seed = task_kwargs.pop("random", None)
        checks.name(task_kwargs.pop("on_divergence", "terminate"), ["terminate"], "on_divergence of rows")
        mode = autoreset_mode.value if isinstance(autoreset_mode, AutoresetMode) else autoreset_mode
        modes = [mode.value for mode in AutoresetMode]
        self.autoreset_mode = AutoresetMode(checks.name(mode, modes, "autoreset_mode"))
        if render_mode is not None:
            checks.name(render_mode, _RENDER_MODES, "render_mode")
        self.num_envs = checks.integer("num_envs", num_envs, 1)
        pictures.check_size(height, width)
        threads = usable_cores() if num_threads is None else checks.integer("num_threads", num_threads, 1)

        self.task, model = prepared(domain_name, task_name, task_kwargs)
        pictures.check_camera(model, camera_id)
        self._step_limit = (
            np.inf if max_episode_steps is None else checks.integer("max_episode_steps", max_episode_steps, 1)
        )

        self.batch = Batch(model, self.num_envs, threads, self.task.reads)
        self._memory = None  # of all rows, with a leading axis
        self._randoms = [np.random.RandomState() for _ in range(self.num_envs)]
        self._carries = [self.task.first() for _ in range(self.num_envs)]
        self._stream_seeds = np.full(self.num_envs, -1)  # Gymnasium's sign for a stream of unknown seed
        self._streams_begin = np.ones(self.num_envs, bool)  # rows whose next episode is the first of its stream
        if seed is not None:
            self._seed(self._seeds(seed), np.ones(self.num_envs, bool))
        self._steps = np.zeros(self.num_envs, int)  # of the present episodes
        self._ended = np.zeros(self.num_envs, bool)  # rows whose episode has ended and whose next has not begun
        self._resting = np.zeros(self.num_envs, bool)

        self.metadata = {
            "render_modes": list(_RENDER_MODES),
            "render_fps": round(1.0 / self.task.scene.control_timestep),
            "autoreset_mode": self.autoreset_mode,
        }
        self.render_mode = render_mode
        self._picture = {
            "width": width,
            "height": height,
            "camera_id": camera_id,
            "depth": render_mode == "depth_array",
        }
        self._observation = np.zeros((self.num_envs, self.task.size), np.float32)  # the latest
        self.single_observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (self.task.size,), np.float32)
        self.single_action_space = gymnasium.spaces.Box(-1.0, 1.0, (model.nu,), np.float32)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)

    @one_thread_at_a_time
    def reset(self, *, seed: int | Sequence[int | None] | None = None, options: Mapping[str, Any] | None = None):
        """Start an episode in every row, or in some.

        Args:
            seed: s to seed row i with s + i, one seed for each row, or None to continue the rows'
                streams of random numbers; a row's seed may be None likewise.
            options: `reset_mask`, (num_envs,) booleans, limits seeding and restart to some rows.

        Returns:
            Observations (num_envs, size) float32 of all rows, and an empty info.

        Raises:
            ValueError: a seed or mask that does not fit.
            ResetNeeded: a mask before every row has been reset once.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("reset")
        rows = self._rows((options or {}).get("reset_mask"))
        if self._memory is None and not rows.all():
            raise ResetNeeded("cannot reset some rows: reset all of them first")
        if seed is not None:
            self._seed(self._seeds(seed), rows)
        self._begin(rows, self._observation)
        return self._observation.copy(), {}

    @one_thread_at_a_time
    def step(self, actions):
        """Advance every row by one control step, but for rows that start an episode instead.

        Args:
            actions: (num_envs, motors), clipped to [-1, 1]; ignored for a row that starts an episode.

        Returns:
            Observations (num_envs, size) float32; rewards (num_envs,); terminated and truncated,
            (num_envs,) booleans; and an info as Gymnasium defines it: `reward_<term>` and
            `progress_<figure>`, of rows that diverged also `diverged`, and in the mode SameStep
            `final_obs` and `final_info` of rows whose episode ended.

        Raises:
            ValueError: actions of another shape, or NaN in one; nothing has moved then.
            ResetNeeded: before the first reset.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("step")
        if self._memory is None:
            raise ResetNeeded("cannot step: no episode has begun; call reset first")
        task, before, data = self.task, self._memory, self.batch.data
        waiting = self._ended & (self.autoreset_mode == AutoresetMode.DISABLED)
        stepping, restarting = ~(self._ended | self._resting), self._ended & ~(self._resting | waiting)
        memory, inputs = task.before(before, checked_action(actions, self.action_space.shape))
        np.copyto(data.ctrl, inputs.ctrl, where=stepping[:, None])
        if inputs.kick is not None:
            data.qvel[stepping] += inputs.kick[stepping]
        diverged = self.batch.step(SUBSTEPS, stepping)
        readings = task.read(data)
        self._memory = memory = _chosen(stepping, task.after(memory, readings), before)
        self._steps += 1

        self._terms = earned = task.terms(memory, readings)
        if diverged.any():
            self._terms = earned = {name: np.where(diverged, 0.0, term) for name, term in earned.items()}
        reward = np.where(stepping, terms.total(earned, task.settings.weights), 0.0)
        observation = task.vector(task.observe(memory, readings), np.float32)
        failed, cut = task.ended(memory, readings)
        time_is_up = self._steps >= task.step_limit
        terminated = stepping & (diverged | failed) & ~time_is_up
        truncated = stepping & ((cut & ~terminated) | time_is_up | (self._steps >= self._step_limit))
        self._ended = waiting | terminated | truncated

        info = {}
        if self.autoreset_mode == AutoresetMode.SAME_STEP and self._ended.any():
            restarting, stepping = self._ended, stepping & ~self._ended
            final = {"final_obs": _by_row(observation, restarting), "final_info": self._info(restarting, diverged)}
            info |= _marked(final, restarting)
        info |= self._info(stepping, diverged)
        if restarting.any():
            self._begin(restarting, observation)
        self._observation = observation.copy()
        return observation, reward, terminated, truncated, info

    @one_thread_at_a_time
    def command(self, name: str, value, rows=None) -> None:
        """Set a command of the task in some rows from now on, until their next episodes.

        Args:
            name: one of the task's `commands`.
            value: (size,) numbers for all rows of the mask, or (num_envs, size), of which the rows of
                the mask count; None, or NaN in some, for what the task itself would do.
            rows: mask (num_envs,) of the rows; None for all.

        Raises:
            ValueError: no such command, or a value or mask that does not fit; one line.
            ResetNeeded: before the first reset.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("command")
        mask, value = self._rows(rows, "rows"), checked_command(self.task, name, value, (self.num_envs,))
        if self._memory is None:
            raise ResetNeeded(f"cannot set command {name!r}: no episode has begun; call reset first")
        present = getattr(self._memory, name)
        self._memory = self._memory._replace(**{name: np.where(mask[:, None], value, present)})

    @one_thread_at_a_time
    def rest(self, mask) -> None:
        """Let rows, and no others, stand still until they are reset; meanwhile they cost next to nothing.

        Args:
            mask: (num_envs,) booleans, at least one of them true.

        Raises:
            ValueError: a mask that does not fit.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("rest")
        self._resting = self._rows(mask, "mask")

    @one_thread_at_a_time
    def snapshot(self) -> dict[str, np.ndarray]:
        """Return, as arrays by name, all that the rows go on from; `restore` of another such environment takes it.

        Raises:
            ResetNeeded: before the first reset.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("take a snapshot")
        if self._memory is None:
            raise ResetNeeded("cannot take a snapshot: no episode has begun; call reset first")
        return snapshots.taken(self)

    @one_thread_at_a_time
    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Go on, to the bit, from the snapshot of an environment with the same rows and the same task.

        Raises:
            ValueError: an array is missing or does not fit; one line. The environment is to be thrown away then.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("restore")
        if self._memory is None:
            self._begin(np.ones(self.num_envs, bool), self._observation)
        snapshots.put(self, arrays)

    @one_thread_at_a_time
    def render(self, rows: Iterable[int] | None = None) -> tuple[np.ndarray, ...] | None:
        """Return pictures of the rows' present states, in the mode and size chosen at the start.

        Args:
            rows: which rows; None for all.

        Returns:
            A picture for each row. rgb_array: (height, width, 3) uint8. depth_array: (height, width)
            float32, m. None without a render mode.

        Raises:
            ValueError: no such row.
            RenderingUnavailable: no OpenGL here.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("render")
        if self.render_mode is None:
            return None
        every = range(self.num_envs)
        rows = every if rows is None else list(rows)
        for row in rows:
            if row not in every:
                raise ValueError(f"rows: expected integers from 0 to {self.num_envs - 1}, got {row!r}")
        return tuple(self._render_row(row) for row in rows)

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

    @property
    def np_random(self) -> tuple[np.random.Generator, ...]:
        """Draw, for each row, from the stream that its resets draw from."""
        return tuple(np.random.Generator(random._bit_generator) for random in self._randoms)

    @property
    def np_random_seed(self) -> tuple[int, ...]:
        """The seed of each row's stream of random numbers; -1 where none was given."""
        return tuple(self._stream_seeds.tolist())

    def call(self, name: str, *args, **kwargs) -> tuple:
        """Call a method, or read an attribute, of every row, as Gymnasium's own vector environments do.

        Args:
            name: of an attribute of this environment; what rows share is the value of each of them.
            *args: of the method.
            **kwargs: of the method.

        Returns:
            A value for each row.

        Raises:
            ValueError: `reset`, `step` or `close`, which are of all rows at once; one line.
            AttributeError: no such attribute.
        """
        if name in ("reset", "step", "close"):
            raise ValueError(f"call {name!r}: rows do it together; call {name} of the environment itself")
        value = getattr(self, _OF_ONE_ROW.get(name, name))
        if callable(value):
            value = value(*args, **kwargs)
        return value if name in _OF_EACH_ROW and value is not None else (value,) * self.num_envs

    def get_attr(self, name: str) -> tuple:
        """Return an attribute of every row; see `call`."""
        return self.call(name)

    def set_attr(self, name: str, values) -> None:
        """Set an attribute that the rows share.

        Args:
            name: of the attribute.
            values: one for all, or a list or tuple of as many equal ones as there are rows.

        Raises:
            ValueError: another number of values, or different ones; one line.
        """
        values = list(values) if isinstance(values, list | tuple) else [values]
        if len(values) not in (1, self.num_envs) or any(value != values[0] for value in values):
            raise ValueError(f"set_attr {name!r}: rows share it; expected one value for all, got {values!r}")
        setattr(self, name, values[0])

    def _check_open(self, call: str) -> None:
        if self.closed:
            raise ClosedEnvironmentError(f"cannot {call}: the environment is closed; make a new one")

    def _render_row(self, row: int) -> np.ndarray:
        task, scene, marks = self.task, self.task.scene, ()
        if self._memory is not None:
            marks = task.marks(_mapped(lambda field: field[row], self._memory), task.read(self.batch.part(row)))
        qpos, mocap_pos = self.batch.data.qpos[row], self.batch.mocap_pos[row]
        return pictures.picture(scene.body, scene.arena, qpos, mocap_pos=mocap_pos, marks=marks, **self._picture)

    def _begin(self, rows: np.ndarray, observation: np.ndarray) -> None:
        """Start episodes in some rows, (num_envs,) booleans, and put their observations among the others."""
        task, starts = self.task, []
        for row in np.flatnonzero(rows):
            if not self._streams_begin[row]:
                self._carries[row] = task.carry(_mapped(lambda field, row=row: field[row], self._memory))
            starts.append(task.start(self._randoms[row], self._carries[row]))
        qpos, qvel, memories, mocap, models = zip(*starts, strict=True)
        self._streams_begin &= ~rows
        mocap = None if mocap[0] is None else np.stack(mocap)
        self.batch.reset(rows, np.stack(qpos), np.stack(qvel), mocap, models)
        memory, readings = _mapped(lambda *fields: np.stack(fields), *memories), task.read(self.batch.part(rows))
        lifted = task.lift(memory, readings)
        if lifted is not None:
            self.batch.place(rows, lifted)
            readings = task.read(self.batch.part(rows))
        memory = task.begin(memory, readings)
        # Before the first step there is nothing to keep, as all rows begin.
        self._memory = memory if self._memory is None else _scattered(rows, memory, self._memory)
        self._steps[rows] = 0
        self._ended, self._resting = self._ended & ~rows, self._resting & ~rows
        observation[rows] = task.vector(task.observe(memory, readings), np.float32)

    def _info(self, rows: np.ndarray, diverged: np.ndarray) -> dict[str, Any]:
        """What the latest step tells of some rows."""
        info = {}
        if rows.any():
            figures = {f"reward_{name}": term for name, term in self._terms.items()}
            figures |= {f"progress_{name}": figure for name, figure in self.task.progress(self._memory).items()}
            info |= _marked({name: np.where(rows, figure, 0.0) for name, figure in figures.items()}, rows)
        diverged = diverged & rows
        if diverged.any():
            info |= _marked({"diverged": diverged}, diverged)
        return info

    def _seeds(self, seed) -> list[int | None]:
        """Return a seed for each row."""
        if np.ndim(seed) == 1:
            if len(seed) != self.num_envs:
                raise ValueError(f"seed: expected one for each of {self.num_envs} rows, got {len(seed)}")
            return [None if row is None else checks.seed(row) for row in seed]
        first = checks.seed(seed)
        return [checks.seed(first + row) for row in range(self.num_envs)]

    def _seed(self, seeds: Sequence[int | None], rows: np.ndarray) -> None:
        """Start new streams of random numbers in some rows, but for rows whose seed is None."""
        for row in np.flatnonzero(rows):
            if seeds[row] is not None:
                self._randoms[row], self._carries[row] = np.random.RandomState(seeds[row]), self.task.first()
                self._stream_seeds[row], self._streams_begin[row] = seeds[row], True

    def _rows(self, mask, name: str = "reset_mask") -> np.ndarray:
        """The rows of a mask; all of them for None."""
        if mask is None:
            return np.ones(self.num_envs, bool)
        mask = np.asarray(mask)
        if mask.shape != (self.num_envs,) or mask.dtype != bool or not mask.any():
            raise ValueError(f"{name}: expected {self.num_envs} booleans, at least one of them true, got {mask!r}")
        return mask.copy()


def usable_cores() -> int:
    """Return how many cores this process may use, where the system tells; else how many there are."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()


def _mapped(function, memory, *others):
    """A memory whose fields a function makes of the fields of memories."""
    return type(memory)(*map(function, memory, *others))


def _chosen(rows: np.ndarray, there, elsewhere):
    """A memory that is one in some rows, (num_envs,) booleans, and another in the other rows."""
    if rows.all():
        return there
    return _mapped(lambda new, old: np.where(rows.reshape(-1, *[1] * (new.ndim - 1)), new, old), there, elsewhere)


def _scattered(rows: np.ndarray, some, memory):
    """A memory with other values in some rows, (num_envs,) booleans, of which there are as many as in `some`."""

    def scattered(new, old):
        copied = old.copy()
        copied[rows] = new
        return copied

    return _mapped(scattered, some, memory)


def _marked(values: Mapping[str, Any], rows: np.ndarray) -> dict[str, Any]:
    """Values by name, and by `_name` the rows that have them, as Gymnasium's infos are."""
    return {key: item for name, value in values.items() for key, item in ((name, value), (f"_{name}", rows.copy()))}


def _by_row(observations: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Some rows' observations in an array of objects, with None for the other rows."""
    objects = np.full(len(observations), None, dtype=object)
    for row in np.flatnonzero(rows):
        objects[row] = observations[row].copy()
    return objects
