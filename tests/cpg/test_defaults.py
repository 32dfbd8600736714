"""What a demonstrator is without a preset, and what is said of one that ignores its task."""

import warnings

import pytest

import arc_suite
from arc_suite.cpg import Demonstrator
from arc_suite.cpg.selection import law, law_class, memoryless_preset, presets_of, suited_preset
from arc_suite.data import DatasetSettings
from arc_suite.envs.setup import Setup
from arc_suite.policies import policy
from arc_suite.policies.protocol import alone
from arc_suite.tasks import TASKS


@pytest.mark.parametrize("task", TASKS)
def test_the_default_is_the_preset_that_suits_the_task(task):
    environment = arc_suite.load("queen", task, {"random": 0})
    definition = environment.task.definition
    timestep = environment.reset()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        default = Demonstrator(environment)(timestep)
        named = Demonstrator(environment, suited_preset(definition))(timestep)
        by_policy = alone(policy("cpg", "queen", task=definition))(timestep)
    assert default.tolist() == named.tolist() == by_policy.tolist()
    assert DatasetSettings(Setup.of("queen", task)).preset_names == (suited_preset(definition),)


@pytest.mark.parametrize(
    ("task", "preset", "ignored"),
    [
        ("steer", "medium", "command"),
        ("stairs", "tuned", "command"),
        ("directed", "medium", "command, pose, gait"),
        ("navigate", "reactive", "goal"),
    ],
)
def test_a_preset_that_ignores_what_a_task_commands_gives_a_warning(task, preset, ignored):
    definition = Setup.of("tick", task).definition
    text = f"preset '{preset}': ignores what the task {task} commands: {ignored}; {suited_preset(definition)} suits it"
    with pytest.warns(UserWarning, match=f"^{text}$"):
        Demonstrator(definition, preset)


@pytest.mark.parametrize(("task", "preset"), [("steer", "reactive"), ("shoved", "reactive"), ("rough", "surefooted")])
def test_networks_without_memory_learn_from_a_preset_of_their_own(task, preset):
    assert memoryless_preset(Setup.of("queen", task).definition) == preset


def test_all_presets_that_obey_a_command_step():
    """One law follows the command of any body, imported ones included."""
    for name in ("queen", "leaper", "varied:7"):
        presets = presets_of(arc_suite.registry.body_of(name))
        laws = {law_class(presets[preset]).__name__ for preset in ("steered", "surefooted", "braced", "reactive")}
        assert laws == {"Stepping"}


@pytest.mark.parametrize("task", TASKS)
def test_every_preset_that_a_task_takes_gets_the_blocks_that_its_law_reads(task):
    """Those of a law within a law count: `straight` steps, and in `directed` it reads pose and gait."""
    definition = Setup.of("tick", task).definition
    environments = Setup.of("tick", task).make_vec(2, num_threads=1)
    observations, _ = environments.reset(seed=0)
    blocks = environments.task.split(observations)
    for name, preset in presets_of(definition.scene.body).items():
        if set(law_class(preset).reads) <= blocks.keys():
            fitted_law = law(definition, preset)
            read_blocks = {block: blocks[block] for block in fitted_law.reads}
            _, actions = fitted_law(fitted_law.initial(2), read_blocks)
            assert actions.shape == (2, 18), name
    environments.close()
