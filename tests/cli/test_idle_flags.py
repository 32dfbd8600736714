"""A flag of any program has an effect beside the others, or is one line; `ALWAYS` lists flags that always have one."""

import re

import programs
import pytest
from refusals import refused

from arc_suite import evaluation
from arc_suite.animation.clips import clip_files
from arc_suite.animation.play_pages import creature
from arc_suite.cli.programs import PROGRAMS
from arc_suite.robots import ROBOTS

BODY = "robot spec legs links length palette"
SET = "set task arena"
COMMON = f"{BODY} {SET} policy vecnormalize preset"
# Flags by program: each has an effect with any others, or is refused as in a case below or in test_flags.py.
ALWAYS = {
    "build_model": "robot spec legs links length palette name output summary render scale seed no_ornaments torso "
    "head tail",
    "import": "armature damping forward home output scale stiffness",
    "check": "task tasks walk",
    "render": f"{COMMON} seed steps output".replace(" preset", ""),
    "animate": f"{COMMON} clips fps straight plant weight output".replace(" preset", ""),
    "motion": f"{BODY} of clip loop fps output",
    "play": f"{BODY} arena policy vecnormalize modules output",
    "view": COMMON.replace(" preset", ""),
    "studio": f"{COMMON} host port".replace(" preset", ""),
    "settings": f"{BODY} {SET}",
    "evaluate": f"{COMMON} episodes seed json".replace(" preset", ""),
    "style": f"{COMMON} compare episodes json output page save".replace(" preset", ""),
    "collect": f"{BODY} {SET} num_envs threads verify",
    "train": f"{BODY} {SET} algorithm hp train_set seed seeds steps prior evaluate_every best config modules minutes "
    "until_score threads tensorboard wandb output",
    "study": "runs results report",
    "benchmark": "results",
    "export": f"{BODY} {SET} vecnormalize output runner",
    "card": "modules",
    "transfer": f"{SET} policy families output",
    "design": "goal task around mass span height power map bodies random steps seed processes pages output",
    "doctor": "",
    "completion": "",
}
NO_MODEL = "goes with --output, as no model is written"
NEITHER = "a model holds body and ground, and this setting changes neither"
NO_SEEDS = "expected none, as stored tracks have their seeds"
OF_VERIFY = "expected none with --verify, as the dataset holds what it was collected by"
OF_REPORT = "goes without --report, which makes no runs"
OF_POLICIES = "goes without --policies, whose names have places and seeds"
NO_PRESET = "preset 'fast': goes with the policy cpg, got"
CONFIG = "expected none with --config, which has the whole configuration"
DIVISION = "goes with a division, such as samples"
VIEWS = "it is for .png, .mp4, .gif, .webp, not for .html"
GLB = "it is for .glb, not for .png"
FILMS = "it is for .mp4, .gif, .webp, not for"
ZERO = "--policy=zero --preset=fast"
CASES = [
    ("build_model", "--robot=tick --no_ornaments", "--no_ornaments: goes with --json, --visuals or --render, as other"),
    ("build_model", "--robot=tick --set=kicks=1", f"--set kicks: {NEITHER}"),
    ("build_model", "--robot=tick --task=stairs --set=rise=0.1 --set=gait=wave", f"--set gait: {NEITHER}"),
    ("build_model", "--robot=tick --set=time_limit=3", f"--set time_limit: {NEITHER}"),
    ("build_model", "--robot=tick --set=arena=bumps --summary", "--set: goes with --output or --render, as no model"),
    ("build_model", "--robot=tick --task=rough --summary", "--task: goes with --output or --render, as no model"),
    ("build_model", "--robot=tick --task=rough --json", "--task: goes without --json, as a spec has no arena"),
    ("build_model", "--robot=tick --arena=rough --summary", "--arena: goes with --output or --render, as no model"),
    ("build_model", "--robot=tick --json --visuals", "--visuals: goes without --json"),
    ("build_model", "--robot=tick --json --no_arena", "--no_arena: goes without --json"),
    ("build_model", "--robot=tick --summary --no_arena", f"--no_arena: {NO_MODEL}"),
    ("build_model", "--robot=tick --render=a.png --visuals", f"--visuals: {NO_MODEL}"),
    ("build_model", "--robot=tick --summary --json", f"--json: {NO_MODEL}"),
    ("build_model", "--robot=tick --layout=radial", "--layout=radial: goes with --legs or --seed, not with --robot"),
    ("train", "--robot=varied:0-1 --palette=moss", "--palette: goes with one body, not with several"),
    ("build_model", "--seed=4 --palette=nonsense", "unknown palette 'nonsense' (there are: "),
    ("build_model", "--seed=4 --length=shin=2", "unknown link 'shin'"),
    ("check", "spider --robot=tick", "--robot: goes with --task, not with a spec file"),
    ("check", "spider --arena=rough", "--arena: goes with --task, not with a spec file"),
    ("check", "spider --set=kicks=1", "--set: goes with --task, not with a spec file"),
    ("import", "robot.xml --feet=", "--feet=: expected a value, got none"),
    ("import", "robot.xml --feet=,", "--feet=,: expected names with commas between them"),
    *((name, f"{ZERO} --output=a.png", f"{NO_PRESET} 'zero'") for name in ("render", "animate")),
    *((name, ZERO, f"{NO_PRESET} 'zero'") for name in ("evaluate", "style", "view", "studio")),
    ("play", f"{ZERO} --output=a.html", f"{NO_PRESET} 'zero'"),
    ("collect", "--policy=random --preset=slow,fast", "preset 'slow': goes with the policy cpg, got 'random'"),
    ("render", "--output=a.html --camera=eye", f"--camera: {VIEWS}"),
    ("render", "--output=a.html --width=64", f"--width: {VIEWS}"),
    ("render", "--output=a.html --height=64", f"--height: {VIEWS}"),
    ("render", "--output=a.png --loop", f"--loop: {FILMS} .png"),
    ("render", "--output=a.html --fps=9", f"--fps: {FILMS} .html"),
    *(("animate", f"--output=a.png --clips=walk --{flag}", f"{flag}: {GLB}") for flag in ("uv", "reduce")),
    ("animate", "--output=a.png --clips=walk --rig=nodes", f"rig: {GLB}"),
    ("animate", "--output=a.png --clips=walk --triangles=9", f"triangles: {GLB}"),
    ("animate", "--output=a.png --clips=walk --root_motion=moving", f"root_motion: {GLB}"),
    ("animate", "--output=a.glb --size=99", "size: it is for .mp4, .gif, .webp, .png, not for .glb"),
    ("animate", "--output=a.glb --directions=9", "directions: it is for .png, not for .glb"),
    ("animate", "--output=a.glb --turntable", f"turntable: {FILMS} .glb"),
    ("animate", "--output=a.glb --transparent", "transparent: it is for .webp, .png, not for .glb"),
    ("style", "--compare_preset=fast", "--compare_preset: goes with --compare=cpg"),
    ("style", "--compare=zero --compare_preset=fast", "--compare_preset=fast: goes with --compare=cpg, got 'zero'"),
    ("style", "--policy=tracks.npz --seed=1", f"--seed: {NO_SEEDS}"),
    ("style", "--output=", "--output=: expected a value, got none"),
    *(
        ("collect", f"--verify=tick-v0 --{flag}", f"--{flag.partition('=')[0]}: {OF_VERIFY}")
        for flag in (
            *("policy=cpg", "vecnormalize=a.pkl", "checkpoint=3", "quality=medium", "preset=fast", "noise=.1"),
            *("episodes=9", "steps=9", "seed=10000", "id=a", "overwrite", "author=me", "code_permalink=here"),
        )
    ),
    ("train", "--jobs=2", "--jobs: goes with several seeds, such as --seed=0,1,2"),
    ("train", "--config=a.json --length=upper=2", f"--length: {CONFIG}"),
    ("train", "--config=a.json --palette=moss", f"--palette: {CONFIG}"),
    *(
        ("study", f"top-ppo --report --{flag}", f"--{flag.partition('=')[0]}: {OF_REPORT}")
        for flag in ("jobs=2", "shard=0/2", "submit=2", "hours=3", "partition=a", "device", "minutes=3")
    ),
    ("study", "top-ppo --hours=3", "--hours: goes with --submit"),
    ("study", "top-ppo --minutes=3", "--minutes: goes with --device"),
    ("study", "top-ppo --device --jobs=2", "--jobs: goes without --device, on which runs learn in this process"),
    ("study", "top-ppo --partition=a", "--partition: goes with --submit"),
    *(
        ("benchmark", f"--{flag}", f"--{flag.partition('=')[0]}: {DIVISION}")
        for flag in ("algorithm=sac", "seeds=1", "places=tick-walk", "jobs=1", "runs=r", "policies=p", "name=n")
    ),
    ("benchmark", "samples --policies=p --algorithm=sac", f"--algorithm: {OF_POLICIES}"),
    ("benchmark", "samples --policies=p --jobs=1", f"--jobs: {OF_POLICIES}"),
    ("benchmark", "samples --name=mine", "--name: goes with --policies"),
    ("benchmark", "samples --policies=", "--policies=: expected a value, got none"),
    ("export", "universal --robot=tick --set=a=1 --set=a=2", "--set a=2: a has a value already"),
    ("export", "run --task=walk", "policy run: --task, --set and --arena go with the body of a policy of many bodies"),
    ("transfer", "--name=mine", "--name: goes with --output"),
    ("transfer", "--families=", "--families=: expected a value, got none"),
    ("design", "--amount=.2 --output=a", "--amount: goes with --around"),
    ("design", "--set=rise=.1 --set=rise=.2 --output=a", "--set rise=.2: rise has a value already"),
    ("evaluate", "--set=kicks=1 --set=kicks=2", "--set kicks=2: kicks has a value already"),
    ("evaluate", "--legs=4 --length=lower=1 --length=lower=2", "--length lower=2: lower has a value already"),
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with stored tracks."""
    place = tmp_path_factory.mktemp("flags")
    arguments = ("--robot=tick", "--set=time_limit=0.2", "--episodes=1", "--save=tracks.npz")
    programs.passed(programs.arc_suite("style", *arguments, cwd=place))
    return place


@pytest.mark.parametrize(("program", "arguments", "line"), CASES, ids=[f"{name} {text}" for name, text, _ in CASES])
def test_a_flag_without_effect_is_one_line(folder, program, arguments, line):
    before = sorted(folder.iterdir())
    done = programs.arc_suite(program, *arguments.split(), cwd=folder)
    if "needs viser" in done.stderr or "no viewer for pages" in done.stderr:
        pytest.skip(done.stderr)
    programs.refused(done, f"arc-suite {program}: {line}")
    assert sorted(folder.iterdir()) == before


@pytest.mark.parametrize("program", PROGRAMS)
def test_every_flag_is_in_a_table(program):
    text = programs.passed(programs.arc_suite(program, "--help"))
    flags = set(re.findall(r"^  (?:-\w, )?--(?:\[no\])?(\w+)", text, re.MULTILINE)) - {"help", "version"}
    refused_flags = {
        match for name, _, line in CASES if name == program for match in re.findall(r"^(?:--)?(\w+)", line)
    }
    if any(line.startswith("preset ") for name, _, line in CASES if name == program):
        refused_flags.add("preset")
    assert flags - refused_flags == set(ALWAYS[program].split()) - refused_flags


def test_colors_and_lengths_of_generated_bodies_have_an_effect():
    def spec(*arguments):
        return programs.passed(programs.arc_suite("build_model", "--json", *arguments))

    for body in ("--legs=4", "--seed=4", "--robot=tick"):
        assert len({spec(body), spec(body, "--palette=rust"), spec(body, "--length=upper=1.5")}) == 3


@pytest.mark.parametrize(
    ("file", "option"),
    [("a.glb", "uv"), ("a.glb", "reduce"), ("a.glb", "straight"), ("a.glb", "plant"), ("a.webp", "turntable")],
)
def test_functions_refuse_words_for_truth_values(file, option, tmp_path):
    with refused(f"{option}: expected true or false, got 'no'"):
        clip_files.animate("tick", tmp_path / file, "walk", **{option: "no", "fps": 20.0})
    assert list(tmp_path.iterdir()) == []


def test_functions_refuse_the_preset_of_other_policies():
    with refused("preset 'fast': goes with the policy cpg, got 'zero'"):
        evaluation.evaluate("zero", "tick", preset="fast", episodes=1)
    with refused("preset 'steered': goes with the policy cpg, got 'universal'"):
        creature(ROBOTS["tick"], "universal", "steered")
    with refused("preset 'fast': goes with the policy cpg, got 'random'"):
        clip_files.animate("tick", "a.glb", policy="random", preset="fast")
