"""Every program takes any body, any task and its settings; every face of the suite takes any body."""

import gymnasium
import interpreters
import numpy as np
import programs
import pytest

import arc_suite
from arc_suite import registry
from arc_suite.bodies import generator
from arc_suite.cpg.selection import preset_names
from arc_suite.envs.gym import Env
from arc_suite.registry import FAMILIES
from arc_suite.robots.spec import PALETTES
from arc_suite.robots.spec_files import EXAMPLES, load_body, save_body

SPIDER, WORDS = EXAMPLES["spider"], ", ".join(registry.robot_words())
FAMILY_WORDS, ONE_LEG = ", ".join(FAMILIES), "of one leg, as l1_upper"
SEEDS_AND_COLORS = "a seed, such as 7, colors, such as #3a5f2b,#d8c48a"
NO_PALETTE = f"unknown palette 'mos'; did you mean 'moss'? (there are: {', '.join(PALETTES)}, {SEEDS_AND_COLORS})"


@pytest.mark.parametrize("program", ["evaluate", "render", "style", "collect"])
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--spec=a.json"], "cannot read a.json: no such file or directory"),
        (["--spec=a.json", "--legs=4"], "expected one of --spec and --legs, got both"),
        (["--links=4"], "--links=4: goes with --legs"),
        (["--legs=4", "--robot=tick"], "--robot=tick: expected no robot with --spec or --legs"),
        (["--length=lower=2"], "--length: goes with --robot, --spec or --legs"),
        (["--legs=4", "--length=shin=2"], f"unknown link 'shin' (there are: upper, middle, lower, {ONE_LEG})"),
        (["--legs=4", "--palette=mos"], NO_PALETTE),
        (["--legs=2"], "flag --legs=2: expected an integer in the range [4, 12]"),
        (
            ["--robot=quen"],
            f"unknown robot 'quen'; did you mean 'queen'? (there are: {WORDS}, all, module:name to import it)",
        ),
        (
            ["--robot=vried:7"],
            f"unknown family 'vried'; did you mean 'varied'? (there are: {FAMILY_WORDS}, module:name to import it)",
        ),
        (["--policy=cgp"], "unknown policy 'cgp'; did you mean 'cpg'? (there are: cpg, zero, random, ppo, universal)"),
        (["--preset=fats"], f"unknown preset 'fats'; did you mean 'fast'? (there are: {', '.join(preset_names())})"),
    ],
)
def test_bad_arguments_are_one_line(program, arguments, message, tmp_path):
    output = [f"--output={tmp_path / 'a.png'}"] if program == "render" else []
    programs.refused(programs.arc_suite(program, *arguments, *output), f"arc-suite {program}: {message}\n")


@pytest.mark.parametrize("policy", ["cpg", "zero"])
def test_feet_in_the_floor_come_with_the_cure(policy, tmp_path):
    body = load_body(SPIDER)
    save_body(body.replace(torso=body.torso.replace(standing_height=0.2)), tmp_path / "low.json")
    arguments = ("--spec=low.json", f"--policy={policy}", "--episodes=1", "--set=time_limit=0.5")
    done = programs.arc_suite("evaluate", *arguments, cwd=tmp_path)
    line = "low.json: feet stand 0.05 m in the floor: standing_height 0.25 fits\n"
    assert (done.returncode, done.stderr) == (0, f"arc-suite evaluate: {line}")
    assert programs.arc_suite("check", "low.json", cwd=tmp_path).stdout == line


@pytest.mark.slow
@pytest.mark.parametrize("program", ["evaluate", "render", "style", "collect"])
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--task=wlak"], "unknown task 'wlak'; did you mean 'walk'? (there are: "),
        (["--set=foo"], "--set foo: expected name=value"),
        (["--set==1"], "--set =1: expected name=value"),
        (["--set=random=1"], "--set random=1: programs seed every episode; see --help for the flag of the first seed"),
        (["--set=target_velocty=1"], "unknown setting of walk 'target_velocty'; did you mean 'target_velocity'? "),
        (["--set", "target_velocity=fast"], "target_velocity: expected a number from -1000 to 1000, got 'fast'"),
    ],
)
def test_bad_tasks_and_settings_are_one_line(program, arguments, message, tmp_path):
    output = ["--output=a.png"] if program == "render" else []
    done = programs.arc_suite(program, *arguments, *output, cwd=tmp_path)
    programs.refused(done, f"arc-suite {program}: {message}")
    assert not (tmp_path / "a.png").exists()


def test_settings_are_json_or_numbers_where_they_parse():
    code = """
import sys
from absl import flags
from arc_suite.cli.flags import define_task, task_from_flags
define_task()
flags.FLAGS(["program", *sys.argv[1:]])
print(task_from_flags())
"""
    settings = ["a=1", "b=2.5", "c=ripple", 'd="ripple"', 'e={"x": [1, null]}', "f=x=y", "g=", "h=Infinity", "i=true"]
    settings += ["j=0.5,1.2", "k=0.5,b", "l=1,NaN", "m=.5", "n=-2.", "o=.5,2", "p=."]
    printed = interpreters.printed(code, *(f"--set={setting}" for setting in settings))
    expected = {"a": 1, "b": 2.5, "c": "ripple", "d": "ripple", "e": {"x": [1, None]}, "f": "x=y", "g": ""}
    expected |= {"h": float("inf"), "i": True, "j": [0.5, 1.2], "k": "0.5,b", "l": "1,NaN"}
    expected |= {"m": 0.5, "n": -2.0, "o": [0.5, 2.0], "p": "."}
    assert printed == [f"{('walk', expected)}"]


@pytest.mark.parametrize("body", [generator.generate(5, 2), SPIDER, str(SPIDER)], ids=["body", "path", "string"])
def test_gymnasium_takes_a_body_where_a_robot_stands(body):
    expected = arc_suite.load(body, "walk", {"random": 7}, {"flat_observation": True}).reset()
    single = Env(body, "walk")
    observation, _ = single.reset(seed=7)
    np.testing.assert_array_equal(observation, expected.observation["observations"].astype(np.float32))
    assert single.metadata["render_fps"] == round(1.0 / single.unwrapped._env.control_timestep())
    single.close()
    made = gymnasium.make("arc_suite/queen-walk-v0", domain_name=body)
    np.testing.assert_array_equal(made.reset(seed=7)[0], observation)
    made.close()
