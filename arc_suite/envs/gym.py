"""The suite as Gymnasium environments: shimmy's adapter for dm_control, with everything else that Gymnasium defines."""

import os
import sys
import types
import weakref
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from gymnasium.error import ClosedEnvironmentError, ResetNeeded
from numpy.typing import ArrayLike

from arc_suite import checks, versions
from arc_suite.envs.calls import KnownAttributes, one_thread_at_a_time
from arc_suite.envs.dm import Environment, TaskRun, load
from arc_suite.envs.prepare import checked_limit, refuse_arguments
from arc_suite.envs.window import Window
from arc_suite.robots.spec import Body
from arc_suite.simulation import opengl, pictures
from arc_suite.simulation.annotations import MjData, MjModel

with versions.explain_import_errors():  # shimmy imports `gym`, and a user's own file may have that name
    from shimmy.dm_control_compatibility import DmControlCompatibilityV0
    from shimmy.utils.dm_env import dm_env_step2gym_step

if TYPE_CHECKING:
    from arc_suite.envs import dm_types as specs
    from arc_suite.simulation.physics import Physics

    class _Adapter(gymnasium.Env[np.ndarray, np.ndarray]):
        """shimmy's adapter, which has no types: whatever inherits from it seems to have every attribute."""

        _env: Environment
        render_kwargs: dict[str, Any]
        dt: float

        def __init__(self, env: Environment, render_kwargs: Mapping[str, Any]) -> None: ...
        def render(self) -> np.ndarray | None: ...  # type: ignore[override]

else:
    _Adapter = DmControlCompatibilityV0

_HEADLESS_MODES = ("rgb_array", "depth_array")


class Env(KnownAttributes, _Adapter):
    """One task of the suite, made by `gymnasium.make("arc_suite/<robot>-<task>-v0", ...)`.

    Observations are the flat vector of the dm_env rounded to float32, actions are float32 in
    [-1, 1]. A step's info contains floats: the task's unweighted terms, `reward_forward` and so
    on, and metrics of how well the episode has gone so far, such as `progress_speed`. A
    reset's info is empty, since no step has been rewarded yet. With `privileged=True` both also contain the
    privileged observation, `privileged` (size,); see `arc_suite.tasks.privileged`.

    An episode is truncated at the task's own time limit, 1000 steps unless `task_kwargs` has another.
    It is terminated when the dm_env's discount is 0, which never happens at the time
    limit. `max_episode_steps` of `gymnasium.make` can truncate it earlier.

    `reset(seed=s)` starts the same episode as `load(..., task_kwargs={"random": s})`. Further resets
    continue its stream of random numbers, of which `np_random` is a view.

    Pickles and copies continue bit for bit, without the resources that were opened for rendering.
    """

    # Modes for which `gymnasium.make` may ask; an instance's own metadata has those that work on this machine.
    metadata = {"render_modes": [*_HEADLESS_MODES, "human"], "render_fps": 20}

    observation_space: gymnasium.spaces.Box
    action_space: gymnasium.spaces.Box

    if TYPE_CHECKING:  # the adapter hands on what the dm_env has

        @property
        def unwrapped(self) -> "Env": ...
        @property
        def physics(self) -> Physics: ...
        @property
        def task_kwargs(self) -> Mapping[str, Any]: ...
        def action_spec(self) -> specs.BoundedArray: ...
        def observation_spec(self) -> Mapping[str, specs.Array]: ...
        def control_timestep(self) -> float: ...

    _FORMER_NAMES = {  # in pickles of earlier versions
        **KnownAttributes._FORMER_NAMES,
        "_tells": "_has_privileged_info",
        "_stepping": "_episode_is_running",
    }

    def __init__(
        self,
        domain_name: str | os.PathLike[str] | Body,
        task_name: str,
        task_kwargs: Mapping[str, Any] | None = None,
        visualize_reward: bool = False,
        render_mode: str | None = None,
        width: int | None = None,
        height: int | None = None,
        camera_id: int | str | None = None,
        privileged: bool = False,
        **others: Any,
    ):
        """Load the task.

        Args:
            domain_name: a robot; see `arc_suite.load`.
            task_name: as in `arc_suite.load`.
            task_kwargs: see `arc_suite.load`.
            visualize_reward: see `arc_suite.load`; only with a render mode.
            render_mode: None, rgb_array, depth_array (m) or, where there is a display, human.
            width: width of a picture, pixels; only with a render mode, as the next two. A window has its own size.
            height: height of a picture, pixels.
            camera_id: a camera's name or index, -1 for a free one.
            privileged: whether infos contain the privileged observation, `privileged` (size,) float32.
            **others: none; they are refused with what takes their place.

        Raises:
            ValueError: an unknown name, or a value that does not fit.
        """
        refuse_arguments(others, type(self).__init__, task_name)
        modes = [*_HEADLESS_MODES, "human"] if opengl.has_display() else [*_HEADLESS_MODES]
        _check_render_mode(render_mode, modes)
        picture_options = pictures.options(render_mode, width, height, camera_id)
        if checks.boolean("visualize_reward", visualize_reward) and render_mode is None:
            raise ValueError("visualize_reward=True: goes with a render_mode, such as 'rgb_array'")
        environment = load(domain_name, task_name, task_kwargs, {"flat_observation": True}, visualize_reward)
        limit = _step_limit_of_make(caller=sys._getframe(1))
        if limit is not None:
            checked_limit(limit, environment.task.definition)
        pictures.check_camera(environment.physics.model.ptr, picture_options["camera_id"])
        self.metadata = {"render_modes": modes}  # else shimmy would write a rate into the class's dictionary
        # From here on the dm_env is `self._env`.
        super().__init__(environment, render_kwargs=picture_options)
        self.metadata["render_fps"] = round(1.0 / environment.control_timestep())
        self.render_mode = render_mode
        self._has_privileged_info = checks.boolean("privileged", privileged)
        shape = environment.observation_spec()["observations"].shape
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, shape, np.float32)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, environment.action_spec().shape, np.float32)
        self._lock = environment._lock
        self._window: Window | None = None
        self._episode_is_running = False
        self._closed = False
        self._sealed_by = __name__

    def set_wrapper_attr(self, name: str, value: Any, **options) -> bool:
        """Set an existing attribute; vector environments of Gymnasium call this.

        Raises:
            AttributeError: there is no such attribute.
        """
        self._check_attribute(name)
        setattr(self, name, value)
        return True

    @property
    def task(self) -> TaskRun:
        """The task; its `split` gives an observation's blocks by name."""
        return self._env.task

    @property
    def data(self) -> MjData:
        """The `mujoco.MjData` of the simulation, as in Gymnasium's MuJoCo environments."""
        return self._env.physics.data.ptr

    @property
    def model(self) -> MjModel:
        """The `mujoco.MjModel` of the simulation, as in Gymnasium's MuJoCo environments."""
        return self._env.physics.model.ptr

    @property
    def np_random(self) -> np.random.Generator:
        """A generator of the stream of random numbers from which resets draw."""
        return np.random.Generator(self._env.task.random._bit_generator)

    @np_random.setter
    def np_random(self, value: np.random.Generator):
        self._env.task.random = np.random.RandomState(value.bit_generator)

    @property
    def np_random_seed(self) -> int:
        """The seed of the stream of random numbers; -1 if it is unknown."""
        return self._env.task.stream_seed

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Start an episode.

        Args:
            seed: None to continue the stream of random numbers, or an integer to start a new one.
            options: there are none; an empty mapping or None.

        Returns:
            The observation, and an info that is empty or has `privileged`.

        Raises:
            ValueError: a seed that is not valid, or an option.
            RuntimeError: another thread is at work in the environment.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("reset")
        option_names = list(checks.mapping("options", options))
        if option_names:
            name = checks.preview(option_names[0])
            raise ValueError(f"unknown option of reset {name}: one environment has none; vector ones have reset_mask")
        observation = self._env.reset(seed).observation
        gymnasium.Env.reset(self, seed=None if seed is None else checks.seed(seed))
        self._episode_is_running = True
        self._show()
        return _to_vector(observation), self._privileged_info()

    def step(self, action: ArrayLike) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Advance by one control step.

        Args:
            action: (motors,), clipped to [-1, 1].

        Returns:
            Observation, reward, terminated, truncated, and an info with floats `reward_<term>` and
            `progress_<metric>`.

        Raises:
            ValueError: an action of another shape or with NaN; nothing has changed then.
            ResetNeeded: before a reset, or after the episode's end.
            RuntimeError: another thread is at work in the environment.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("step")
        if not self._episode_is_running:
            raise ResetNeeded("cannot step: the episode has ended or has not begun; call reset first")
        timestep = self._env.step(action)
        observation, reward, terminated, truncated, _ = dm_env_step2gym_step(timestep)
        self._episode_is_running = not timestep.last()
        self._show()
        task = self._env.task
        info = _to_floats("reward", task.terms) | _to_floats("progress", task.progress) | self._privileged_info()
        return _to_vector(observation), float(reward), terminated, truncated, info

    def command(self, name: str, value: ArrayLike | str | None) -> None:
        """Set a command of the task from now on, until the next episode; see `arc_suite.envs.dm.Environment.command`.

        Raises:
            ValueError: an unknown command, or a value of another size.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("command")
        self._env.command(name, value)

    def change_model(self, fields: Mapping[str, Any]) -> None:
        """Set fields of the model from the next step on; see `arc_suite.envs.dm.Environment.change_model`."""
        self._check_open("change the model")
        self._env.change_model(fields)

    def change_settings(self, settings: Mapping[str, Any]) -> None:
        """Set settings from the next reset on; see `arc_suite.envs.dm.Environment.change_settings`."""
        self._check_open("change settings")
        self._env.change_settings(settings)

    def snapshot(self) -> dict[str, np.ndarray]:
        """Return the state as arrays by name, for `restore`.

        The state of wrappers around this environment, such as `TimeLimit`, is not part of it.

        Raises:
            ResetNeeded: before the first reset.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("take a snapshot")
        if self._env.task.memory is None:
            raise ResetNeeded("cannot take a snapshot: no episode has begun; call reset first")
        return self._env.snapshot()

    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Continue, bit-exactly, from the snapshot of an environment of the same task.

        Raises:
            ValueError: an array is missing or does not fit; the state has not changed.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("restore")
        self._env.restore(arrays)
        self._episode_is_running = not arrays["ended"][0]

    def render(self) -> np.ndarray | None:
        """Return a picture of the present state, in the mode and size that were chosen at the start.

        Returns:
            In the mode rgb_array (height, width, 3) uint8; in depth_array (height, width) float32, m; else None.

        Raises:
            RenderingUnavailable: no OpenGL here.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("render")
        return super().render()

    @one_thread_at_a_time
    def close(self) -> None:
        """Free the simulation and the resources of rendering; a second call does nothing.

        Raises:
            RuntimeError: another thread is at work in the environment.
        """
        self._closed = True
        if self._window is not None:
            self._window.close()
            self._window = None
        super().close()

    def _privileged_info(self) -> dict[str, np.ndarray]:
        """Return the part of an info with the privileged observation; empty unless it was asked for."""
        return {"privileged": self._env.task.privileged_vector()} if self._has_privileged_info else {}

    def _check_open(self, action: str) -> None:
        """Raise ClosedEnvironmentError after `close`; `action` says in the error what was called."""
        if self._closed:
            raise ClosedEnvironmentError(f"cannot {action}: the environment is closed; make a new one")

    def _show(self) -> None:
        """In the mode human, show the present state in the window, at the pace of the simulated time."""
        if self.render_mode != "human":
            return
        decorated = self._env.physics.decorated_pose()
        if self._window is None:
            self._window = Window(decorated, self.render_kwargs["camera_id"])
            weakref.finalize(self, self._window.close)  # at the latest before the interpreter unloads GLFW
        self._window.show(self.dt, decorated.markers)

    def __getstate__(self):
        self._check_open("copy")
        return self.__dict__ | {"_window": None}


def _check_render_mode(render_mode: str | None, modes: Sequence[str]) -> None:
    """Raise ValueError for a render mode that does not exist, or that does not work on this machine."""
    if render_mode is None:
        return
    if render_mode == "human" and "human" not in modes:
        raise ValueError(f"render_mode 'human' needs a display, and there is none; use {' or '.join(modes)}")
    checks.name(render_mode, modes, "render_mode")


def _step_limit_of_make(caller: types.FrameType) -> int | None:
    """Return the step limit with which `gymnasium.make` was called, from the frame of that call; None for no limit.

    `make` hands the limit to `TimeLimit` alone: the environment's own spec has None. An additional wrapper of the spec
    would get it, too, but `make_vec` refuses specs that have both such wrappers and a vector entry point.
    """
    if caller.f_code is not gymnasium.make.__code__:
        return None
    limit = caller.f_locals.get("max_episode_steps")
    if limit is None:
        spec = caller.f_locals.get("env_spec")
        limit = getattr(spec, "max_episode_steps", None)
    return None if limit == -1 else limit  # -1 is Gymnasium's value for no limit


def _to_floats(prefix: str, values: Mapping[str, Any]) -> dict[str, float]:
    return {f"{prefix}_{name}": float(value) for name, value in values.items()}


def _to_vector(observation) -> np.ndarray:
    """Return the flat observation of a dm_env as Gymnasium's float32."""
    return observation["observations"].astype(np.float32)
