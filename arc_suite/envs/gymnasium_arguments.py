"""Arguments of Gymnasium's locomotion environments, such as Ant-v5, and what takes their place here."""

import json
import numbers
from collections.abc import Mapping
from typing import Any

from arc_suite import checks
from arc_suite.robots.field_hints import GRAVITY_HINT
from arc_suite.tasks.contract import Task

# Argument -> terms of a reward that take its place, of which a task has one, and the sign of their weights.
_TERMS: Mapping[str, tuple[tuple[str, ...], int]] = {
    "forward_reward_weight": (("forward", "progress"), 1),
    "healthy_reward": (("healthy",), 1),
    "ctrl_cost_weight": (("control",), -1),
    "contact_cost_weight": (("contact",), -1),
}
_NO_RANGE = [0.0, 1000.0]  # m, in which every torso is
_FORCES = {"exclude_blocks": ["contact_forces"]}

_FORCE_HINT = "observations have contact forces, unless exclude_blocks names them"
_FALL = "a fall ends an episode; healthy_range of walk bounds the torso's height, m"
_CONTROL_STEP = "the control step is that of the body; control_timestep() of arc_suite.load returns it"
_LIMIT = "the setting time_limit limits episodes, s: steps times control_timestep() of arc_suite.load"
_LIMIT_NAMES = ("episode_length", "episode_steps", "horizon", "max_episode_length", "max_episode_steps", "max_steps")
HINTS = {
    **dict.fromkeys(_LIMIT_NAMES, _LIMIT),
    "control_timestep": _CONTROL_STEP,
    "dt": _CONTROL_STEP,
    "frame_skip": _CONTROL_STEP,
    "timestep": _CONTROL_STEP,
    "gravity": GRAVITY_HINT,
    "xml_file": "arc_suite.envs.gym.Env('go2.xml', 'walk') opens a robot from a file",
    "render_fps": "pictures have the rate of control steps, metadata['render_fps']",
    "camera_name": "camera_id takes names, too, with a render_mode",
    "default_camera_config": "camera_id chooses a camera, with a render_mode",
    "healthy_angle_range": _FALL,
    "healthy_state_range": _FALL,
    "healthy_z_range": _FALL,
    "terminate_when_unhealthy": _FALL,
    "use_contact_forces": _FORCE_HINT,
    "include_cfrc_ext_in_observation": _FORCE_HINT,
    **dict.fromkeys(_TERMS, "the setting weights has the weight of every term of the reward"),
    "exclude_current_positions_from_observation": "observations do not have x and y of the torso",
    "n_envs": "gymnasium.make_vec makes several environments",
}


def find_settings(name: str, value: Any, task: type[Task]) -> dict[str, Any]:
    """Return the settings of a task that take the place of an argument with its value; none if there are none.

    None are known of a task of another package that does not list its settings.
    """
    if not task.names():
        return {}
    if name in _TERMS:
        terms, sign = _TERMS[name]
        term = next((term for term in terms if term in task.weights), None)
        is_number = isinstance(value, numbers.Real) and not isinstance(value, bool)
        return {} if term is None else {"weights": {term: sign * value if is_number else task.weights[term]}}
    if name in ("use_contact_forces", "include_cfrc_ext_in_observation"):
        return _FORCES if _is_off(value) else {}
    settings = {}
    if name == "reset_noise_scale":
        settings = {"base_noise": value, "joint_noise": value}
    elif name == "healthy_z_range":
        settings = {"healthy_range": value}
    elif name == "terminate_when_unhealthy" and _is_off(value):
        settings = {"healthy_range": _NO_RANGE}
    return settings if settings.keys() <= set(task.names()) else {}


def _is_off(value: Any) -> bool:
    return isinstance(value, bool | int) and not value


def refuse_settings(settings: Mapping[str, Any], task: type[Task]) -> None:
    """Raise ValueError for a setting that is an argument of Gymnasium, with the settings that take its place.

    A task of another package that does not list its settings checks them itself.
    """
    if not task.names():
        return
    for name, value in settings.items():
        if name in task.names():
            continue
        cures = find_settings(name, value, task)
        if cures:
            texts = [f"{cure}={json.dumps(cure_value, default=repr)}" for cure, cure_value in cures.items()]
            raise ValueError(f"setting {name!r}: {task.name} has {checks.quote(' and '.join(texts))} in its place")
        if name in HINTS:
            raise ValueError(f"setting {name!r}: {HINTS[name]}")
