"""What people type by habit, of other libraries and other notations, is taken or answered by one line with the cure."""

import programs
import pytest

import arc_suite
from arc_suite import checks

POLICY = """
class Agent:
    pass


class Learner:
    def __init__(self, robot):
        self.predict = print
"""
INTEGER = "expected an integer in the range [1, 100000]"
BARE = "is an argument without a flag"
INSTEAD = 'walk has weights={"forward": 2} in its place\n'
SPAN = "expected a number from 0 to 100, or two of them, the lower first"
AMOUNT = "programs have one amount of output; 2>/dev/null hides progress and warnings\n"
FURTHER = "--algorithm finetune --hp start=RUN trains the policy of a run further\n"
LINES = {
    "evaluate --log_dir=a": "unknown flag 'log_dir'; did you mean 'json'? (there are: ",
    "train --log_dir=a": "unknown flag 'log_dir'; did you mean 'output'? (there are: ",
    "evaluate --v=2": "unknown flag '-v'; did you mean --vecnormalize or --version?\n",
    "evaluate --logtostderr": f"unknown flag 'logtostderr'; {AMOUNT}",
    "evaluate --verbosity 3": f"unknown flag 'verbosity'; {AMOUNT}",
    "evaluate --flagfile=x": "unknown flag 'flagfile'; write its flags into the command; arc-suite train --config ",
    "evaluate --undefok=a": "unknown flag 'undefok' (there are: arena, ",
    "train walk": "unexpected argument 'walk'; did you mean --task=walk? see --help\n",
    "train --robot tick walk": "unexpected argument 'walk'; did you mean --task=walk? see --help\n",
    "train sac": "unexpected argument 'sac'; did you mean --algorithm=sac? see --help\n",
    "train --agent=ppo": "unknown flag 'agent'; did you mean --algorithm=ppo?\n",
    "train --model ppo": "unknown flag 'model'; did you mean --algorithm=ppo?\n",
    "train --model=spider.json": "unknown flag 'model'; did you mean --spec=spider.json?\n",
    "train --ent_coef=0.01": "unknown flag 'ent_coef'; in its place ppo has --hp initial_std and final_std, sac has ",
    "train --hp ent_coef=0.01": "unknown hyperparameter 'ent_coef'; did you mean 'initial_std'? (there are: ",
    "train --headless": "unknown flag 'headless'; arc-suite view alone opens a window\n",
    "train --eval_freq 100": "unknown flag 'eval_freq'; did you mean 'evaluate_every'? (there are: ",
    "train --save_freq=9": "unknown flag 'save_freq'; a run saves its policy at each evaluation, see --evaluate_e",
    "train --load=runs/a": f"unknown flag 'load'; {FURTHER}",
    "train --wandb_project=a": "unknown flag 'wandb_project'; Weights & Biases reads variables: WANDB_PROJECT, ",
    "train --video": "unknown flag 'video'; arc-suite render films the policy of a run, arc-suite view shows it\n",
    "train --lr 3e-4": "unknown flag 'lr'; did you mean --hp learning_rate=3e-4 or --hp policy_rate=3e-4?\n",
    "train --steps=100,000": "flag --steps=100,000: expected a positive integer; did you mean --steps=100000?\n",
    "benchmark samples --wandb": "unknown flag 'wandb'; arc-suite train has --tensorboard and --wandb, for a run of ",
    "evaluate --policy=pol": "unknown policy 'pol'; did you mean pol.py:Agent?\n",
    "motion walk.fbx": "unknown extension '.fbx' (there are: .npz, .glb, .bvh, .csv); Blender reads it, and writes a ",
    "train --lr=1e-4": "unknown flag 'lr'; did you mean --hp learning_rate=1e-4 or --hp policy_rate=1e-4?\n",
    "train --gamma .9": "unknown flag 'gamma'; did you mean --hp discount=.9?\n",
    "train --n_envs=8": "unknown flag 'n_envs'; did you mean --hp num_envs=8?\n",
    "train --batch-size=8": "unknown flag 'batch_size'; did you mean --hp minibatch=8 or --hp batch=8?\n",
    "train --hp lr=1e-4": "unknown hyperparameter 'lr'; did you mean 'policy_rate'? (there are: ",
    "train --hp gamma=.9": "unknown hyperparameter 'gamma'; did you mean 'discount'? (there are: ",
    "train --hp num_envs=1k": "hyperparameter num_envs: expected int like 64, got '1k'; did you mean 1000?\n",
    "train --algorithm=PPO2": "unknown algorithm 'PPO2'; did you mean 'ppo'? (there are: ",
    "train --algorithm=td3": "unknown algorithm 'td3'; did you mean 'sac'? (there are: ",
    "evaluate --task=stand": "unknown task 'stand'; did you mean 'walk'? (there are: ",
    "evaluate --task=Stairs": "unknown task 'Stairs'; did you mean 'stairs'? (there are: ",
    "evaluate --set forward_reward_weight=2": f"setting 'forward_reward_weight': {INSTEAD}",
    "evaluate --set episode_length=200": "setting 'episode_length': the setting time_limit limits episodes, s: steps ",
    "evaluate --set weights=2": 'weights: expected a mapping of names to numbers, such as {"forward": 1.5}, got 2\n',
    "evaluate --set speed=2": "unknown setting of walk 'speed'; did you mean 'target_velocity'? (there are: ",
    "evaluate --speed=2": "unknown flag 'speed'; did you mean --set target_velocity=2?\n",
    "evaluate --set seed=5": "--set seed=5: programs seed every episode; see --help for the flag of the first seed\n",
    "animate --seed=5": "unknown flag 'seed' (there are: ",
    "train --algo=sac": "unknown flag 'algo'; did you mean 'algorithm'? (there are: ",
    "train --total_timesteps=1e5": "unknown flag 'total_timesteps'; did you mean 'steps'? (there are: ",
    "train --resume=runs/a": "unknown flag 'resume'; the same command goes on where it was interrupted\n",
    "train --device=cuda": "unknown flag 'device'; learners compute on the device of JAX; see docs/gpu.md\n",
    "train --out=runs/a": "unknown flag 'out'; did you mean 'output'? (there are: ",
    "evaluate --run=runs/a": "unknown flag 'run'; did you mean 'policy'? (there are: ",
    "evaluate --checkpoint=runs/a": "unknown flag 'checkpoint'; did you mean 'policy'? (there are: ",
    "evaluate --output=a.json": "unknown flag 'output'; did you mean 'json'? (there are: ",
    "export --policy=runs/a": f"unknown flag 'policy'; the run {BARE}: runs/a\n",
    "export --run runs/a": f"unknown flag 'run'; the run {BARE}: runs/a\n",
    "export --run": f"unknown flag 'run'; the run {BARE}\n",
    "export runs/a --format=onnx": "unknown flag 'format'; the extension of the output is its format\n",
    "benchmark --division=samples": f"unknown flag 'division'; the division {BARE}: samples\n",
    "benchmark samples --output=a": "unknown flag 'output'; did you mean 'results'? (there are: ",
    "render --duration=3": "unknown flag 'duration'; did you mean 'steps'? (there are: ",
    "render --resolution=640x480": "unknown flag 'resolution'; did you mean 'width'? (there are: ",
    "animate --creature=queen": "unknown flag 'creature'; did you mean 'robot'? (there are: ",
    "animate --animation=walk": "unknown flag 'animation'; did you mean 'clips'? (there are: ",
    "train --steps=1e5": "flag --steps=1e5: expected a positive integer; did you mean --steps=100000?\n",
    "evaluate --episodes=1.5k": f"flag --episodes=1.5k: {INTEGER}; did you mean --episodes=1500?\n",
    "evaluate --episodes=1.5": f"flag --episodes=1.5: {INTEGER}\n",
    "evaluate --episodes=1e6": f"flag --episodes=1e6: {INTEGER}\n",
    "evaluate --friction=0.5,1.2": "unknown flag 'friction'; did you mean --set friction=0.5,1.2?\n",
    "evaluate --set friction=0.5-1.2": f"friction: {SPAN}, got '0.5-1.2'; did you mean [0.5, 1.2]?\n",
    "evaluate --set exclude_blocks=posture,gait_clock": "exclude_blocks: expected names of blocks, got "
    '\'posture,gait_clock\'; did you mean ["posture", "gait_clock"]?\n',
    "build_model --legs=6 --palette=purple": "unknown palette 'purple' (there are: moss, rust, bone, coral, night, a",
    "build_model --legs=6 --palette=3a5f2b,#fff": "unknown palette '3a5f2b,#fff'; did you mean '#3a5f2b,#ffffff'? (",
    "build_model --legs=6 --palette=#3A5F2B;#D8C48A": "unknown palette '#3A5F2B;#D8C48A'; did you mean '#3a5f2b,#d8c",
    "evaluate --policy=x.onnx": "policy 'x.onnx': it is for other programs; expected the folder of the run",
    "evaluate --policy=out/x.pt": "policy 'out/x.pt': write a function that loads it, and name it as file.py:",
    "render --policy=config.json -o a.png": "policy 'config.json': it is no policy; expected the folder of a run\n",
    "evaluate --policy=pol.py": "policy 'pol.py': expected pol.py:NAME, a function in it that makes a policy from a "
    "robot's name (there are: pol.py:Agent, pol.py:Learner)\n",
    "evaluate --policy=other.py": "cannot read other.py: no such file",
    "evaluate --policy=pol.py:Agent": "policy 'pol.py:Agent': expected a function of one argument, a robot's name, got "
    "Agent()\n",
    "evaluate --policy=pol.py:Learner": "policy 'pol.py:Learner': expected it to return a function of a TimeStep, got "
    "Learner; did you mean its method predict?\n",
    "evaluate --policy=runs": "policy 'runs': it has runs in it; did you mean 'runs/tick-walk-ppo-0'?\n",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("habits")
    (folder / "pol.py").write_text(POLICY)
    (folder / "runs" / "tick-walk-ppo-0").mkdir(parents=True)
    (folder / "runs" / "tick-walk-ppo-0" / "policy.npz").touch()
    return folder


@pytest.mark.parametrize("command", LINES)
def test_one_line_with_the_cure(command, folder):
    program, *arguments = command.split()
    has_robot = program != "benchmark" and "--legs" not in command
    robot = ["--robot=tick"] if has_robot else []
    done = programs.arc_suite(program, *robot, *arguments, cwd=folder)
    programs.refused(done, f"arc-suite {program}: {LINES[command]}")


@pytest.mark.parametrize(
    ("value", "text"),
    [
        ("1e5", "100000"),
        ("2M", "2000000"),
        ("100,000", "100000"),
        ("1,00", ""),
        (64.0, "64"),
        ("0.5k", "500"),
        ("1e-5", ""),
        ("1.5", ""),
        ("9e99", ""),
        ("k", ""),
        (64, ""),
        ("64", ""),
        ("-1e3", ""),
    ],
)
def test_an_integer_in_another_notation(value, text):
    assert checks.hint_integer(value) == (f"; did you mean {text}?" if text else "")


@pytest.mark.parametrize(
    ("robot", "near"), [("ant", "leaper"), ("Ant-v5", "leaper"), ("dog", "hound"), ("QUEEN", "queen")]
)
def test_robots_of_other_suites_get_the_nearest(robot, near):
    with pytest.raises(ValueError, match=f"^unknown robot '{robot}'; did you mean '{near}'\\? "):
        arc_suite.load(robot, "walk")


@pytest.mark.parametrize("task", ["walk", "recover", "mimic", "steer"])
def test_the_setting_of_a_seed_is_random(task):
    with pytest.raises(ValueError, match=f"^unknown setting of {task} 'seed'; did you mean 'random'\\? "):
        arc_suite.load("tick", task, {"seed": 5})
