"""Arguments of Gymnasium's locomotion environments are refused with settings that are taken."""

import gymnasium
import numpy as np
import pytest

import arc_suite
from arc_suite.envs import gym, gymnasium_arguments, vector

CURES = [
    ("forward_reward_weight", 0.5, "walk", {"weights": {"forward": 0.5}}),
    ("forward_reward_weight", 0.5, "steer", {"weights": {"progress": 0.5}}),
    ("forward_reward_weight", "much", "walk", {"weights": {"forward": 1.5}}),
    ("ctrl_cost_weight", 0.5, "walk", {"weights": {"control": -0.5}}),
    ("contact_cost_weight", 0.1, "rough", {"weights": {"contact": -0.1}}),
    ("healthy_reward", 2, "walk", {"weights": {"healthy": 2}}),
    ("terminate_when_unhealthy", False, "walk", {"healthy_range": [0.0, 1000.0]}),
    ("healthy_z_range", [0.1, 0.5], "walk", {"healthy_range": [0.1, 0.5]}),
    ("reset_noise_scale", 0.05, "walk", {"base_noise": 0.05, "joint_noise": 0.05}),
    ("include_cfrc_ext_in_observation", False, "steer", {"exclude_blocks": ["contact_forces"]}),
]
NO_CURES = [
    ("forward_reward_weight", 0.5, "recover", "the setting weights has the weight of every term of the reward"),
    ("healthy_reward", np.zeros(2), "mimic", "the setting weights has the weight of every term of the reward"),
    ("terminate_when_unhealthy", False, "steer", "a fall ends an episode; "),
    ("terminate_when_unhealthy", np.zeros(2), "walk", "a fall ends an episode; "),
    ("use_contact_forces", True, "walk", "observations have contact forces, "),
    ("frame_skip", 5, "walk", "the control step is that of the body; "),
    ("xml_file", "a.xml", "walk", "arc_suite.envs.gym.Env('go2.xml', 'walk') opens a robot from a file"),
]


@pytest.mark.parametrize(("name", "value", "task", "settings"), CURES)
def test_a_cure_is_named_and_taken(name, value, task, settings):
    for open_environment in (gym.Env, vector.VectorEnv, arc_suite.load):
        with pytest.raises(ValueError) as refusal:
            open_environment("tick", task, **{name: value})
        assert str(refusal.value) == f"argument {name!r}: write task_kwargs={settings} in its place"
    with pytest.raises(ValueError, match=f"^setting '{name}': {task} has ") as refusal:
        arc_suite.load("tick", task, {name: value})
    assert all(f"{setting}=" in str(refusal.value) for setting in settings)
    arc_suite.load("tick", task, settings).close()


@pytest.mark.parametrize(("name", "value", "task", "hint"), NO_CURES)
def test_what_has_no_setting_is_said_to_have_none(name, value, task, hint):
    with pytest.raises(ValueError) as refusal:
        arc_suite.load("tick", task, {name: value})
    assert str(refusal.value).startswith(f"setting {name!r}: {hint}")
    gymnasium.register_envs(arc_suite)
    with pytest.raises(ValueError) as refusal:
        gymnasium.make(f"arc_suite/tick-{task}-v0", **{name: value})
    assert str(refusal.value).startswith(f"argument {name!r}: {hint}")


def test_no_setting_of_a_task_has_such_a_name():
    assert not arc_suite.registry.setting_names() & gymnasium_arguments.HINTS.keys()
