"""The suite as Gymnasium environments: shimmy's adapter, with what Gymnasium's users rely on."""

import sys
import types
import weakref
from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import ClosedEnvironmentError, ResetNeeded
from shimmy.dm_control_compatibility import DmControlCompatibilityV0
from shimmy.utils.dm_env import dm_env_step2gym_step

from arc_suite import checks
from arc_suite.envs.calls import KnownAttributes, one_thread_at_a_time
from arc_suite.envs.dm import load
from arc_suite.envs.prepare import checked_limit
from arc_suite.envs.task_view import TaskView
from arc_suite.envs.window import Window
from arc_suite.simulation import opengl, pictures

_HEADLESS_MODES = ("rgb_array", "depth_array")


class Env(KnownAttributes, DmControlCompatibilityV0):
    """One task of the suite, made by `gymnasium.make("arc_suite/<robot>-<task>-v0", ...)`.

    Observations are the flat vector of the dm_env rounded to float32, actions are float32 in
    [-1, 1]. A step's info holds plain floats: the task's unweighted terms, `reward_forward` and so
    on, and figures of how well the episode has gone so far, such as `progress_speed`; a
    reset's info is empty, since nothing has been rewarded yet. With `privileged=True` both also hold the
    privileged observation, `privileged` (size,); see `arc_suite.tasks.privileged`.

    An episode is truncated at the task's own time limit, 1000 steps unless `task_kwargs` says
    otherwise, and terminated when the dm_env's discount is 0, which never happens at the time
    limit. Longer episodes need both `task_kwargs={"time_limit": seconds}` and `max_episode_steps`.

    `reset(seed=s)` starts the episode of `load(..., task_kwargs={"random": s})`; further resets
    continue its stream of random numbers; `np_random` is a view of it.

    Pickles and copies carry on bit for bit, without whatever was opened for rendering.
    """

    # What `gymnasium.make` may ask for; an instance's own metadata has what works here.
    metadata = {"render_modes": [*_HEADLESS_MODES, "human"], "render_fps": 20}

    _np_random_seed = -1  # Gymnasium's sign for a stream of unknown seed, here until a seed is given

    def __init__(
        self,
        domain_name: str,
        task_name: str,
        task_kwargs: Mapping[str, Any] | None = None,
        visualize_reward: bool = False,
        render_mode: str | None = None,
        width: int = 640,
        height: int = 480,
        camera_id: int | str = "tracking",
        privileged: bool = False,
    ):
        """Load the task.

        Args:
            domain_name: a robot; see `arc_suite.load`.
            task_name: as in `arc_suite.load`.
            task_kwargs: see `arc_suite.load`.
            visualize_reward: see `arc_suite.load`.
            render_mode: None, rgb_array, depth_array (m) or, where there is a display, human.
            width: of a picture, pixels; a window has its own size.
            height: of a picture, pixels.
            camera_id: a camera's name or index, -1 for a free one.
            privileged: whether infos hold the privileged observation, `privileged` (size,) float32.

        Raises:
            ValueError: an unknown name, or a value that does not fit.
        """
        modes = [*_HEADLESS_MODES, *(["human"] if opengl.has_display() else [])]
        if render_mode == "human" and render_mode not in modes:
            raise ValueError(f"render_mode 'human' needs a display, and there is none; use {' or '.join(modes)}")
        if render_mode is not None:
            checks.name(render_mode, modes, "render_mode")
        pictures.check_size(height, width)
        environment = load(domain_name, task_name, task_kwargs, {"flat_observation": True}, visualize_reward)
        if (limit := _limit_of_make(sys._getframe(1))) is not None:
            checked_limit(limit, environment.task.definition)
        pictures.check_camera(environment.physics.model.ptr, camera_id)
        self.metadata = {"render_modes": modes}  # before shimmy writes a rate into the class's
        super().__init__(environment, render_kwargs={"width": width, "height": height, "camera_id": camera_id})
        self.metadata["render_fps"] = round(1.0 / environment.control_timestep())
        self.render_mode = render_mode
        self._tells = checks.boolean("privileged", privileged)
        size = environment.observation_spec()["observations"].shape
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, size, np.float32)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, environment.action_spec().shape, np.float32)
        self._lock = environment._lock
        self._window: Window | None = None
        self._stepping = False  # between a reset and the end of its episode
        self._closed = False
        random = (task_kwargs or {}).get("random")
        if random is not None and not isinstance(random, np.random.RandomState):
            self._np_random_seed = checks.seed(random)
        self._made = __name__

    def set_wrapper_attr(self, name: str, value: Any, **options) -> bool:
        """Set an attribute that there is, as vector environments of Gymnasium do.

        Raises:
            AttributeError: there is no such attribute.
        """
        self._check_known(name)
        setattr(self, name, value)
        return True

    @property
    def task(self) -> TaskView:
        """The task; its `split` gives an observation's blocks by name."""
        return self._env.task

    @property
    def np_random(self) -> np.random.Generator:
        """Draws from the stream that resets draw from."""
        return np.random.Generator(self._env.task.random._bit_generator)

    @np_random.setter
    def np_random(self, value: np.random.Generator):
        self._env.task.random = np.random.RandomState(value.bit_generator)
        self._np_random_seed = -1

    def reset(self, *, seed: int | None = None, options: dict | None = None):
        """Start an episode.

        Args:
            seed: None to continue the stream of random numbers, or an integer to start a new one.
            options: there are none; an empty mapping or None.

        Returns:
            The observation, and an info that is empty or has `privileged`.

        Raises:
            ValueError: not a seed, or an option.
            RuntimeError: another thread is at work in the environment.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("reset")
        for name in checks.mapping("options", options):
            raise ValueError(
                f"unknown option of reset {checks.preview(name)}: one environment has none; vector ones have reset_mask"
            )
        observation = self._env.reset(seed).observation
        gymnasium.Env.reset(self, seed=None if seed is None else checks.seed(seed))
        self._stepping = True
        self._show()
        return _flat(observation), self._privileged()

    def step(self, action):
        """Advance by one control step.

        Args:
            action: (motors,), clipped to [-1, 1].

        Returns:
            Observation, reward, terminated, truncated, and an info with floats `reward_<term>` and
            `progress_<figure>`.

        Raises:
            ValueError: an action of another shape or with NaN; nothing has changed then.
            ResetNeeded: before a reset, or after the episode's end.
            RuntimeError: another thread is at work in the environment.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("step")
        if not self._stepping:
            raise ResetNeeded("cannot step: the episode has ended or has not begun; call reset first")
        timestep = self._env.step(action)
        observation, reward, terminated, truncated, _ = dm_env_step2gym_step(timestep)
        self._stepping = not timestep.last()
        self._show()
        run = self._env.task
        info = _floats("reward", run.terms) | _floats("progress", run.progress) | self._privileged()
        return _flat(observation), float(reward), terminated, truncated, info

    def command(self, name: str, value) -> None:
        """Set a command of the task from now on, until the next episode; see `arc_suite.envs.dm.Environment.command`.

        Raises:
            ValueError: no such command, or a value of another size.
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
        """Return the state as arrays by name, from which `restore` goes on.

        Wrappers around this environment, such as `TimeLimit`, keep a state of their own.

        Raises:
            ResetNeeded: before the first reset.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("take a snapshot")
        if self._env.task.memory is None:
            raise ResetNeeded("cannot take a snapshot: no episode has begun; call reset first")
        return self._env.snapshot() | {"stream_seeds": np.array([self._np_random_seed])}

    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Go on, bit-exact, from the snapshot of an environment of the same task.

        Raises:
            ValueError: an array is missing or does not fit; none has been used.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("restore")
        self._env.restore(arrays)
        self._np_random_seed, self._stepping = int(arrays["stream_seeds"][0]), not arrays["ended"][0]

    def render(self):
        """Return a picture of the present state in the mode and size chosen at the start.

        Returns:
            rgb_array: (height, width, 3) uint8. depth_array: (height, width) float32, m. Else None.

        Raises:
            RenderingUnavailable: no OpenGL here.
            ClosedEnvironmentError: after `close`.
        """
        self._check_open("render")
        return super().render()

    @one_thread_at_a_time
    def close(self):
        """Free the simulation and what it was rendered with; once more does nothing.

        Raises:
            RuntimeError: another thread is at work in the environment.
        """
        self._closed = True
        if self._window is not None:
            self._window.close()
            self._window: Window | None = None
        super().close()

    def _privileged(self) -> dict[str, np.ndarray]:
        return {"privileged": self._env.task.privileged_vector()} if self._tells else {}

    def _check_open(self, call: str) -> None:
        if self._closed:
            raise ClosedEnvironmentError(f"cannot {call}: the environment is closed; make a new one")

    def _show(self) -> None:
        """In human mode: brings the window up to date, at the pace of the simulated time."""
        if self.render_mode != "human":
            return
        decorated = self._env.physics.decorated()
        if self._window is None:
            self._window = Window(decorated, self.render_kwargs["camera_id"])
            weakref.finalize(self, self._window.close)  # before the interpreter takes GLFW apart
        self._window.show(self.dt, decorated.markers)

    def __getstate__(self):
        return self.__dict__ | {"_window": None}

    def __setstate__(self, state):
        self.__dict__.update(state)


def _limit_of_make(caller: types.FrameType) -> int | None:
    """The step limit that `gymnasium.make` was asked for, from its frame.

    `make` tells it to `TimeLimit` alone: the environment's own spec has None. Additional wrappers of the spec
    would see it, but `make_vec` refuses specs that have both those and a vector entry point.
    """
    if caller.f_code is not gymnasium.make.__code__:
        return None
    limit, spec = caller.f_locals.get("max_episode_steps"), caller.f_locals.get("env_spec")
    limit = getattr(spec, "max_episode_steps", None) if limit is None else limit
    return None if limit == -1 else limit  # Gymnasium's word for no limit of its own


def _floats(kind: str, figures: Mapping[str, Any]) -> dict[str, float]:
    return {f"{kind}_{name}": float(figure) for name, figure in figures.items()}


def _flat(observation) -> np.ndarray:
    return observation["observations"].astype(np.float32)
