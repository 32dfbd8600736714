"""Mistakes at the command line: one line each, with the cure where one is near."""

import wave

import numpy as np
import programs
import pytest
from tiers import tiers

from arc_suite.animation.clips.catalog import CLIPS
from arc_suite.arenas import ARENAS
from arc_suite.tasks import TASKS


def listed(names):
    """Return names as errors list them."""
    return f"(there are: {', '.join(names)}, module:name to import it)"


BARE = "is an argument without a flag"
GETUP = f"{listed(CLIPS)}; not known either: 'getup'\n"
ROBOTS = "(there are: queen, bastion, tick, leaper, "
# What follows the name of the program; those of the first part have a cure that was missing once.
CURED = {
    "--robot tick": "arc-suite: --robot: expected a program before its flags, such as arc-suite evaluate --robot\n",
    "evaluate --robot=tick --policy=PPO": "unknown policy 'PPO'; did you mean 'ppo'?",
    "evaluate --robot=tick --set kicks:1.5": "--set kicks:1.5: expected name=value; did you mean kicks=1.5?\n",
    "card runs/nothing": "runs/nothing: no folder of a run\n",
    "play --robot tick -o tick": "tick: expected a name that ends in .html\n",
    "animate --robot tick -o clips": "clips: expected a name that ends in .glb, ",
}
LEARNER = "it is an algorithm; arc-suite train --algorithm="
RUN = "learns a policy, whose name is the folder of the run\n"
OTHERS = {
    "evaluate --robot Tick": f"unknown robot 'Tick'; did you mean 'tick'? {ROBOTS}",
    "evaluate --robots tick": "unknown flag 'robots'; did you mean 'robot'?",
    "evaluate --robot=tick --task=Walk": "unknown task 'Walk'; did you mean 'walk'?",
    "evaluate --robot=tick --task=walking": "unknown task 'walking'; did you mean 'walk'?",
    "evaluate --robot=tick --policy=sac": f"policy 'sac': {LEARNER}sac {RUN}",
    "evaluate --robot=tick --set kicks": "--set kicks: expected name=value\n",
    "evaluate --robot=tick --set kick=1.5": "unknown setting of walk 'kick'; did you mean 'kicks'?",
    "evaluate --robot=tick --set=kicks=high": "kicks: expected a number from 0 to 100, got 'high'",
    "evaluate --robot=tick --set gait=gallop": "unknown gait 'gallop' (there are: trot, ",
    "evaluate --robot=tick --json": "--json: expected a value, got none\n",
    "evaluate --robot=tick --seed=-1": "flag --seed=-1: expected a non-negative integer\n",
    "evaluate --spec=note.txt": "note.txt: expected a body in JSON; line 1, column 1: it is no JSON",
    "evaluate --spec=body.json": "body.json: torso: missing; a Body needs it\n",
    "evaluate --spec=missing.urdf": "cannot read missing.urdf: no such file or directory\n",
    "evaluate --legs=100": "flag --legs=100: expected an integer in the range [4, 12]\n",
    "evaluate --robot=varied": "unknown robot 'varied'; did you mean 'varied:7'?",
    "evaluate --robot=varied:x": "robot 'varied:x': expected varied:seed or varied:first-last, such as varied:0-9\n",
    "evaluate --robot=tick --preset=ppo": "unknown preset 'ppo' (there are: slow, medium, fast, ",
    "render --robot tick --output": "--output: expected a value, got none\n",
    "render --robot tick --output tick.avi": "unknown extension '.avi' (there are: .png, .mp4, .gif, .webp, .html)\n",
    "render --robot tick -o tick.mp4 --fps=fast": "flag --fps=fast: expected a number in the range [1.0, 1000.0]\n",
    "render --robot tick -o tick.mp4 --steps=0": "--steps=0: expected 1 or more for a film or a page\n",
    "animate --robot tick --clips=walk,runn -o a.glb": "unknown clip 'runn'; did you mean 'run'?",
    "animate --robot tick -o a.fbx": "a.fbx: clips are written as .glb; tools/to_fbx.py makes .fbx of it",
    "play tick": "unexpected argument 'tick'; did you mean --robot=tick? see --help\n",
    "build_model --legs=6 --output=/nowhere/a.xml": "cannot write /nowhere/a.xml: no such file or directory\n",
    "build_model queen": "unexpected argument 'queen'; did you mean --robot=queen? see --help\n",
    "import go2.urdf": "cannot read go2.urdf: no such file or directory\n",
    "check spidr": "unknown robot 'spidr'; did you mean 'spider'?",
    "collect --robot tick --policy cpg --episodes 0": "flag --episodes=0: expected an integer in the range [1, 100000]",
    "motion a.npz": "cannot read a.npz: no such file or directory\n",
    "style --robot tick --compare": "--compare: expected a value, got none\n",
    "completion powershell": "unknown shell 'powershell' (there are: bash, zsh, fish)\n",
    "doctor --fix": "unknown flag 'fix'; its lines say what to do\n",
    "build_model --legs=8 --color=red": "unknown flag 'color'; did you mean 'palette'?",
    "build_model --legs=8 --ballast=iron": "unknown flag 'ballast'; docs/bodies.md: heads, tails and ballast\n",
    "build_model --legs=8 --mass=3": "unknown flag 'mass'; docs/bodies.md: heads, tails and ballast\n",
    "build_model --legs=8 -o a.stl": "unknown extension '.stl' (there are: .xml); arc-suite animate writes a .glb, whi",
    "build_model --legs=8 -o a.glb": "unknown extension '.glb' (there are: .xml); arc-suite animate writes .glb\n",
    "render --legs=8 -o a.glb": "unknown extension '.glb' (there are: .png, .mp4, .gif, .webp, .html); arc-suite anim",
    "play --legs=8 -o a.mp4": "unknown extension '.mp4' (there are: .html); arc-suite render writes pictures, films ",
    "render --robot=tick -r 30": "unknown flag 'r'; did you mean --fps?\n",
    "render --robot=tick -t 5": "unknown flag 't'; did you mean --steps?\n",
    "render -i body.json": "unknown flag 'i'; did you mean --spec or --policy?\n",
    "render --robot=tick -y": "unknown flag 'y'; files are written over\n",
    "render --robot=tick --transparent": "unknown flag 'transparent'; arc-suite animate --transparent writes a pictur",
    "animate --robot=tick --frames=60": "unknown flag 'frames'; a clip lasts a whole cycle; --fps sets its pictures\n",
    "play --robot=tick --task=steer": "unknown flag 'task'; a page has the task of its policy\n",
    "studio --open=body.json": "unknown flag 'open'; did you mean 'spec'?",
    "studio --share": "unknown flag 'share'; did you mean 'host'?",
    "design --spec=body.json": "unknown flag 'spec'; did you mean --around?\n",
    "design --legs=8": "unknown flag 'legs'; the search chooses legs; --around keeps those of a creature\n",
    "design --minutes=3": "unknown flag 'minutes'; --bodies bounds the search\n",
    "check --fix body.json": "unknown flag 'fix'; arc-suite studio --spec FILE has a button for the value that fits\n",
    "check body.json my.json": "unexpected argument 'my.json'; it takes one at a time; see --help\n",
    "completion --install": "unknown flag 'install'; its output goes into a file; see --help\n",
}
COLORS = "a shell drops what follows a #: quote the colors, --palette='#3a5f2b'\n"
BRITISH = "colo" + "ur"
SPLIT = "a shell splits at spaces without quotes; see --help\n"
OTHERS |= {
    "studio --host=localhost:9000": "--host=localhost:9000: expected a host alone; did you mean --host=localhost -",
    "studio --host=http://localhost:9000/": "--host=http://localhost:9000/: expected a host alone; did you mean --hos",
    "studio --host=http://localhost": "--host=http://localhost: expected a host alone; did you mean --host=localho",
    "studio --port=localhost:9000": "flag --port=localhost:9000: expected an integer in the range [1, 65535]; did you ",
    "render --size=320x240 -o=a.png": "unknown flag 'size'; did you mean --width and --height?\n",
    "study samples-mine.search": "study 'samples-mine.search': it is a folder; did you mean samples-mine:search?\n",
    "studio --host=[::1]:9000": "--host=[::1]:9000: expected a host alone; did you mean --host=::1 --port=9000?\n",
    "studio --host=[::1]": "--host=[::1]: expected a host alone; did you mean --host=::1?\n",
    "studio --port=[::1]:9000": "flag --port=[::1]:9000: expected an integer in the range [1, 65535]; did you mean "
    "--host=::1 --port=9000?\n",
    "studio --host=:9000": "--host=:9000: expected a host alone; did you mean --port=9000?\n",
    "studio --host=9000": "--host=9000: expected a host alone; did you mean --port=9000?\n",
    "studio --host=*": "--host=*: expected a host alone; did you mean --host=0.0.0.0?\n",
    "render --robot=tick --palette": f"--palette: expected a value, got none; {COLORS}",
    "render --palette --robot=tick": f"--palette: expected a value, got the flag --robot=tick; {COLORS}",
    "render --robot=tick --palette -o a.png": f"--palette: expected a value, got the flag -o; {COLORS}",
    "evaluate --set --robot=tick": "--set: expected a value, got the flag --robot=tick\n",
    "evaluate --json --robot tick": "--json: expected a value, got the flag --robot\n",
    "render --robot -h": "--robot: expected a value, got the flag -h\n",
    "evaluate --set weights={forward: 2}": (
        f"unexpected argument '2}}'; did you mean --set 'weights={{\"forward\": 2}}'? {SPLIT}"
    ),
    "evaluate --set friction=[0.5, 1.2] --robot tick": (
        f"unexpected argument '1.2]'; did you mean --set 'friction=[0.5, 1.2]'? {SPLIT}"
    ),
    "evaluate --gravity=1.62": "unknown flag 'gravity'; environment.change_model sets it, see docs/environments.md\n",
    "evaluate --terrain=rough": "unknown flag 'terrain'; did you mean 'arena'? (there are: ",
    "evaluate --wind=1": "unknown flag 'wind'; did you mean --set force=1?\n",
    "evaluate --set gravity=1": "setting 'gravity': environment.change_model({'gravity': [0.0, 0.0, -1.62]})",
    "evaluate --set terrain=rough": "unknown setting of walk 'terrain'; did you mean 'arena'? (there are: ",
    f"build_model --legs=8 --{BRITISH}=red": f"unknown flag '{BRITISH}'; did you mean 'palette'? (there are: ",
    "evaluate --chekpoint=runs/tick": "unknown flag 'chekpoint'; did you mean 'policy'? (there are: ",
    "train --total_timestep=100": "unknown flag 'total_timestep'; did you mean 'steps'? (there are: ",
}
BODY = "expected a body, .json, .xml or .urdf"
WAVE = f"{wave.__file__} was read, as the name of ./wave.py is taken: give that file another name\n"
# Files and words in the place of others.
MISPLACED = {
    "evaluate --robot=tick --policy=folder": "cannot read folder/policy.npz: no such file; a run writes it",
    "evaluate --robot=tick --policy=clip.glb": "policy 'clip.glb': it is no policy; expected the folder of a run\n",
    "evaluate --robot=tick --policy=array.npy": "policy 'array.npy': it is no policy; expected the folder of a run\n",
    "evaluate --robot=tick --policy=model.onnx": "policy 'model.onnx': it is for other programs; expected the folder",
    "evaluate --robot=tick --policy=broken.py:make": "policy 'broken.py:make': /",
    "evaluate --robot=tick --policy=steered": "policy 'steered': it is a preset; expected as preset, next to a policy",
    "evaluate --robot=tick --policy=tick": "policy 'tick': it is a robot; expected as robot, next to a policy",
    "evaluate --policy=foldr": "unknown policy 'foldr'; did you mean folder?\n",
    "evaluate --robot=folder": "robot 'folder': it is a folder; expected a name, or a file .json, .xml, ",
    "evaluate --robot=gallery": "robot 'gallery': it is a folder; expected a name, or a file .json, .xml, .urdf; did "
    "you mean gallery/bodies/a.json?\n",
    "render --spec=./gallery": "cannot read gallery: is a directory; did you mean gallery/bodies/a.json?\n",
    "import gallery": "cannot read gallery: is a directory; did you mean gallery/bodies/a.json?\n",
    "check gallery/design.json": "gallery/design.json: expected a body in JSON, got the report of a search: its ",
    "check runs/tick": "cannot read runs/tick: is a directory; --policy takes the folder of a run\n",
    "evaluate --spec=clip.glb": f"clip.glb: {BODY}; a .glb holds clips\n",
    "evaluate --robot=page.html": f"page.html: {BODY}; a .html holds a page\n",
    "import arrays.npz": f"arrays.npz: {BODY}; a .npz holds arrays, such as a policy or a motion\n",
    "animate --spec=my_design.json": "my_design.json: expected a body in JSON, got a design: open it in arc-suite ",
    "animate --spec=my.clips.json": "my.clips.json: expected a body in JSON, got what arc-suite animate tells of clips",
    "check my": "unknown robot 'my'; did you mean my.json? (there are: queen, bastion, ",
    "evaluate --robot=my": "unknown robot 'my'; did you mean my.json? (there are: queen, bastion, ",
    "evaluate --arena=ground": f"unknown arena 'ground'; did you mean ground.png? {listed(ARENAS)}\n",
    "animate --spec=mi -o a.glb": "unknown robot 'mi' (there are: ",
    "animate --spec=boddy -o a.glb": "unknown robot 'boddy'; did you mean body.json?\n",
    "animate --clips=walk_loop,idle -o a.glb": "unknown clip 'walk_loop'; did you mean 'walk'?\n",
    "animate --clips=walk_in_place_loop -o a.glb": "unknown clip 'walk_in_place_loop'; did you mean 'walk'?\n",
    "animate --clips=arrays -o a.glb": "unknown clip 'arrays'; did you mean arrays.npz?\n",
    "animate --clips=wave:bow -o a.glb": f"clip 'bow': wave registers no such clip by arc_suite.register; {WAVE}",
    "evaluate --policy=wave:make": f"policy 'wave:make': module 'wave' has no attribute 'make'; {WAVE}",
    "evaluate --spec=boddy.json": "cannot read boddy.json: no such file or directory; did you mean body.json?\n",
    "evaluate --robot=spider.json": "cannot read spider.json: no such file or directory; did you mean spider?\n",
    "evaluate --robot=tick --task=queen": "task 'queen': it is a robot; tasks are walk, steer, ",
    "evaluate --robot=walk": "robot 'walk': it is a task; robots are queen, bastion, tick, leaper\n",
    "evaluate -r tick": "unknown flag '-r'; did you mean --robot?\n",
    "evaluate -p cpg": "unknown flag '-p'; did you mean --palette or --policy or --preset?\n",
    "evaluate --robot=tick --set motion=attack.npz": "setting 'motion': walk has none; mimic has it\n",
    "evaluate --robot=tick --set weights.forward=2": (
        "--set weights.forward=2: expected a name without a dot; did you mean 'weights={\"forward\": 2}'?\n"
    ),
    "check clip.glb": f"clip.glb: {BODY}; a .glb holds clips\n",
    "build_model --robot=tick --output=tick.urdf": "unknown extension '.urdf' (there are: .xml); the suite "
    "writes bodies as MJCF\n",
    "build_model --robot=tick --json --output=tick.xml": "--output=tick.xml: a spec is .json; without --json the ",
    "motion clip.glb --robot=tick -o a.npz": "clip.glb: expected a binary glTF file",
    "motion arrays.npz --robot=tick -o a.npz": "arrays.npz: expected a motion, or arrays as mjlab has them",
    "animate --robot=tick --clips=arrays.npz -o a.glb": "arrays.npz: no motion, or a damaged one: ",
    "render --robot=tick -o folder": "folder: expected a name that ends in .png, .mp4, .gif, .webp, .html\n",
    "render --robot=tick -o missing/a.png": "cannot write missing/a.png: no such file or directory\n",
    "collect --robot=tick --policy=refined": "policy 'refined': it is a preset; expected as preset, next to a policy",
}
DOWNLOAD = "it is an address: download the file, and name its path\n"
ID = "it is an id of Gymnasium; its robot is tick, its task"
ONE = "expected one name=value; did you mean"
LIST = "a list has commas and no spaces; see --help\n"
RIGS = "(there are: skin, nodes)\n"
MOTION = "expected a name, or a motion, .npz; arc-suite motion makes one of a .glb, a .bvh or a table\n"
# What people type who come from Gymnasium, an animation program or a page of the internet.
CHARACTER = "takes a character: heavy, nervous or old\n"
FIRST_HOUR = {
    "evaluate --robot https://example.com/go2": f"robot 'https://example.com/go2': {DOWNLOAD}",
    "evaluate --spec=https://example.com/spider.json": "cannot read https:/example.com/spider.json: no such file or "
    f"directory; {DOWNLOAD}",
    "import package://go2/go2.urdf": f"cannot read package:/go2/go2.urdf: no such file or directory; {DOWNLOAD}",
    "motion https://example.com/a.bvh": f"cannot read https:/example.com/a.bvh: no such file or directory; {DOWNLOAD}",
    "evaluate --robot=tick --policy=hf://a/b": f"policy 'hf://a/b': {DOWNLOAD}",
    "export https://example.com/run": f"policy 'https://example.com/run': {DOWNLOAD}",
    "evaluate --robot=tick --json=/": "cannot write /: is a directory\n",
    "build_model --robot=tick --output=/": "cannot write /: is a directory\n",
    "evaluate --robot=tick --json=..": "cannot write ..: is a directory\n",
    "evaluate robot=tick": "unexpected argument 'robot=tick'; did you mean --robot=tick? see --help\n",
    "evaluate –robot tick": "unexpected argument '–robot'; did you mean --robot? see --help\n",
    "evaluate —robot=tick": "unexpected argument '—robot=tick'; did you mean --robot=tick? see --help\n",
    "evaluate --robot=arc_suite/tick-walk-v0": f"robot 'arc_suite/tick-walk-v0': {ID} walk\n",
    "evaluate --robot=tick-walk-v0": f"robot 'tick-walk-v0': {ID} walk\n",
    "evaluate --task=tick-steer-v0": f"task 'tick-steer-v0': {ID} steer\n",
    "evaluate --set gait=trot,kicks=1": f"--set gait=trot,kicks=1: {ONE} --set gait=trot --set kicks=1?\n",
    "build_model --spec=spider --length=upper=1.2,lower=2": f"--length upper=1.2,lower=2: {ONE} --length upper=1.2 --",
    "evaluate --set episodes=5": "--set episodes=5: it is a flag; did you mean --episodes=5?\n",
    "evaluate --set robot=queen": "--set robot=queen: it is a flag; did you mean --robot=queen?\n",
    "animate --clips walk idle -o a.glb": f"unexpected argument 'idle'; did you mean --clips=walk,idle? {LIST}",
    "animate -o a.glb --clips=walk, idle": f"unexpected argument 'idle'; did you mean --clips=walk,idle? {LIST}",
    "import --feet a b go2.xml": f"unexpected argument 'go2.xml'; did you mean --feet=a,b? {LIST}",
    "import go2.xml --feet a b": f"unexpected argument 'b'; did you mean --feet=a,b? {LIST}",
    "evaluate --robot queen tick": f"unexpected argument 'tick'; did you mean --robot=queen,tick? {LIST}",
    "animate --robot queen tick": "unexpected argument 'tick'; did you mean --robot=tick? see --help\n",
    "evaluate --set kicks=1 gait=trot": "unexpected argument 'gait=trot'; did you mean --set kicks=1 --set gait=trot? ",
    "animate --robot=tick --weight=slow -o a.glb": "unknown weight 'slow' (there are: heavy, nervous, old, a number fr",
    "build_model --legs=4 --length=front=2": "unknown link 'front' (there are: upper, middle, lower, of one leg, as l",
    "animate --palette=moss -o a.glb": "--palette: goes with --robot, --spec or --legs\n",
    "animate --name=krabbo": "unknown flag 'name'; arc-suite build_model --name NAME --json writes a spec with a name",
    "evaluate --robot=tick --preset=steered": "observation: expected a block command, as the task steer has (--task ",
    "import --urdf=go2.urdf": f"unknown flag 'urdf'; the robot {BARE}: go2.urdf\n",
    "import --urdf go2.urdf": f"unknown flag 'urdf'; the robot {BARE}: go2.urdf\n",
    "import -o a.json --mjcf go2.urdf": f"unknown flag 'mjcf'; the robot {BARE}: go2.urdf\n",
    "import --file go2.urdf": f"unknown flag 'file'; the robot {BARE}: go2.urdf\n",
    "import --xml go2.urdf": f"unknown flag 'xml'; the robot {BARE}: go2.urdf\n",
    "import --input go2.urdf": f"unknown flag 'input'; the robot {BARE}: go2.urdf\n",
    "import --path go2.urdf": f"unknown flag 'path'; the robot {BARE}: go2.urdf\n",
    "import --model go2.urdf": f"unknown flag 'model'; the robot {BARE}: go2.urdf\n",
    "import --robot go2.urdf": f"unknown flag 'robot'; the robot {BARE}: go2.urdf\n",
    "motion --input walk.npz": f"unknown flag 'input'; the file {BARE}: walk.npz\n",
    "import --spec=go2.urdf": f"unknown flag 'spec'; the robot {BARE}: go2.urdf\n",
    "evaluate --urdf=go2.urdf": "unknown flag 'urdf'; did you mean 'spec'? (there are: ",
    "evaluate --robot=tick --task=patrol": f"unknown task 'patrol' {listed(TASKS)}\n",
    "evaluate --robot=tick;queen": f"unknown robot 'tick;queen'; did you mean 'tick,queen'? {ROBOTS}",
    "animate --clips=walk+run -o a.glb": "unknown clip 'walk+run'; did you mean 'walk,run'? (there are: walk, slow, ",
    "animate --clips=walking,idle,getup -o a.glb": f"unknown clip 'walking'; did you mean 'walk'? {GETUP}",
    "animate --weight=old,nervous -o a.glb": "weight: expected one name or one number, got 'old,nervous'\n",
    "animate --temperament=old": f"unknown flag 'temperament'; arc-suite animate --weight {CHARACTER}",
    "animate --style=old": f"unknown flag 'style'; did you mean --weight? it {CHARACTER}",
    "animate --legs=3 -o a.glb": "flag --legs=3: expected an integer in the range [4, 12]; a body of 3 legs is a spec",
    "animate --set step_height=0.1 -o a.glb": "unknown setting of steer 'step_height'; no setting lifts feet, the pres",
    "build_model --legs=6 --palette=#fff,#12345g": "palette '#fff,#12345g': '#12345g' is no color; expected such as #",
    "animate --clips=note.txt -o a.glb": f"clip 'note.txt': {MOTION}",
    "animate --clips=dance.bvh -o a.glb": f"clip 'dance.bvh': {MOTION}",
    "animate --rig=bones -o a.glb": f"unknown rig 'bones'; did you mean 'skin'? {RIGS}",
    "animate --rig=armature -o a.glb": f"unknown rig 'armature'; did you mean 'skin'? {RIGS}",
    "animate --root_motion=false -o a.glb": "unknown root_motion 'false'; did you mean 'in_place'? (there are: both, ",
    "render --camera=side -o a.png": "unknown camera 'side'; did you mean 'profile'? (there are: tracking, portrait, ",
    "animate spider.json": "unexpected argument 'spider.json'; did you mean --spec=spider.json? see --help\n",
    "build_model go2.urdf": "unexpected argument 'go2.urdf'; did you mean --spec=go2.urdf? see --help\n",
    "render clip.glb": "unexpected argument 'clip.glb'; Blender, Godot and other programs show a .glb: see docs/",
    "view page.html": "unexpected argument 'page.html'; a browser shows a page; see --help\n",
    "render tick.mp4": "unexpected argument 'tick.mp4'; did you mean --output=tick.mp4? see --help\n",
    "render folder": "unexpected argument 'folder'; did you mean --policy=folder? see --help\n",
    "train --policy=ppo": "unknown flag 'policy'; did you mean 'algorithm'? (there are: algorithm, arena, ",
    "train --hp steps=100": "--hp steps=100: it is a flag; did you mean --steps=100?\n",
    "train --algorithm=dagger --hp num_envs=9999999": "num_envs: expected an integer from 2 to 1048576, got 9999999",
    "train --hp hidden=1000000000": "hidden: expected an integer from 1 to 65536, got 1000000000\n",
    "train --hp num_envs=1000000000": "num_envs: expected an integer from 1 to 1048576, got 1000000000\n",
    "train --hp horizon=1000000000": "horizon: expected an integer from 1 to 65536, got 1000000000\n",
    "train --hp epochs=1000000000": "epochs: expected an integer from 1 to 65536, got 1000000000\n",
    "train --hp minibatch=1000000000": "minibatch: expected an integer from 1 to 16777216, got 1000000000\n",
    "train --algorithm=sac --hp n_step=1000000000": "n_step: expected an integer from 1 to 65536, got 1000000000\n",
    "train --algorithm=dagger --hp round=1000000000": "round: expected an integer from 1 to 65536, got 1000000000\n",
    "export runs": "policy 'runs': it has runs in it; did you mean 'runs/tick'?\n",
    "export runs/tick/config.json": "policy 'runs/tick/config.json': it is no policy; expected the folder of a run\n",
    "card runs": "runs: no folder of a run; did you mean runs/tick?\n",
    "card runs/tick/policy.npz": "runs/tick/policy.npz: no folder of a run; did you mean runs/tick?\n",
    "style --compare=clip.glb": "policy 'clip.glb': it is no policy; expected the folder of a run\n",
    "style --compare=tick": "policy 'tick': it is a robot; expected as robot, next to a policy such as cpg\n",
    "import go2.usd": "go2.usd: expected a body, .json, .xml or .urdf; a .usd holds a robot for another simulator, ",
    "version extra": "arc-suite: unexpected argument 'extra'; version takes none\n",
    "tick": "arc-suite: tick: expected a program first, such as arc-suite evaluate --robot=tick\n",
    "walk": "arc-suite: walk: expected a program first, such as arc-suite evaluate --task=walk\n",
}
DATASETS = "--id names a dataset; datasets lie in ~/.minari/datasets, or where MINARI_DATASETS_PATH points\n"
NO_TASK = "a page has the task of its policy\n"
FRICTION = "did you mean --set friction=0.5?"
LOWER_CASE = "expected 1 to 32 characters out of [a-z0-9_]"
NO_FOLDER = "expected a folder, got the name of a file"
# What once was answered by a wrong cure.
WRONG_CURES = {
    "train --robot=tick --ppo": "unknown flag 'ppo'; did you mean --algorithm=ppo?\n",
    "evaluate --ppo": "unknown flag 'ppo'; did you mean --policy=ppo?\n",
    "evaluate --walk": "unknown flag 'walk'; did you mean --task=walk?\n",
    "evaluate --steered": "unknown flag 'steered'; did you mean --preset=steered?\n",
    "train --name mine": "unknown flag 'name'; --output names the folder of the run\n",
    "train --path runs/x": "unknown flag 'path'; --output names the folder of the run\n",
    "train --value 3": "unknown flag 'value' (there are: algorithm, ",
    "collect --robot tick -o data": f"unknown flag 'o'; {DATASETS}",
    "collect --policy=cpg --output=data": f"unknown flag 'output'; {DATASETS}",
    "collect --path data": f"unknown flag 'path'; {DATASETS}",
    "collect -n 5": "unknown flag '-n'; did you mean --episodes?\n",
    "collect --format hdf5": "unknown flag 'format'; datasets have Minari's format\n",
    "evaluate -o a.json": "unknown flag '-o'; did you mean --json?\n",
    "play --robot walker -o a.html": "unknown robot 'walker'; did you mean 'walkers'? (there are: ",
    "play --set target_velocity=1": f"unknown flag 'set'; {NO_TASK}",
    "play --mode goals": "unknown flag 'mode'; the end of the page's address says it, page.html#mode=goals\n",
    "play --open": "unknown flag 'open'; a browser shows the page\n",
    "animate --list": "unknown flag 'list'; --help lists the names that flags take\n",
    "transfer --families all": "--families=all: without the flag, all families play\n",
    "benchmark samples --policy ppo": "unknown flag 'policy'; did you mean 'policies'? (there are: ",
    "help train evaluate": "arc-suite: unexpected argument 'evaluate'; help takes one program\n",
    "train -o": "-o: expected a value, got none\n",
    "evaluate --robot=tick --json=a.csv": "unknown extension '.csv' (there are: .json)\n",
    "evaluate --seeds 0-9": "unknown flag 'seeds'; --episodes counts on from --seed: --seed=0 --episodes=10 are seeds",
    "animate --scale 2": "unknown flag 'scale'; --length NAME=FACTOR stretches links, and arc-suite ",
    "benchmark samples --seeds 5": "flag --seeds=5: expected an integer in the range [1, 3]; more seeds are a study of "
    "one's own, docs/study.md\n",
    "benchmark samples --seeds 0": "flag --seeds=0: expected an integer in the range [1, 3]\n",
    "benchmark samples --steps 9": "unknown flag 'steps'; a division has its steps; arc-suite train has --steps\n",
    "benchmark samples --submit 2": "unknown flag 'submit'; arc-suite study DIVISION-ALGORITHM makes the same runs, "
    "and has --submit and --shard\n",
    "benchmark --robot tick": "unknown flag 'robot'; --places takes robots with their tasks, such as tick-walk\n",
    "train --from RUN": "unknown flag 'from'; --algorithm finetune --hp start=RUN trains the policy of a run further\n",
    "design --robot tick": "unknown flag 'robot'; did you mean --around?\n",
    "collect arc_suite/tick/walk/cpg-v0": "unexpected argument 'arc_suite/tick/walk/cpg-v0'; did you mean",
    "datasets": "arc-suite: unknown program 'datasets'; did you mean collect?\n",
    "tasks": "arc-suite: unknown program 'tasks'; arc-suite evaluate --help lists robots and tasks\n",
    "video -o a.mp4": "arc-suite: unknown program 'video'; did you mean render?\n",
    "evaluate --checkpoint 9 --policy RUN": "unknown flag 'checkpoint'; did you mean --policy=RUN/checkpoints/9?\n",
    'evaluate --set {"friction":0.5}': f'--set {{"friction":0.5}}: expected name=value; {FRICTION}\n',
    "evaluate --set friction 0.5": f"unexpected argument '0.5'; {FRICTION} see --help\n",
    "play --robot=tick --policy dagger -o a.html": f"policy 'dagger': {LEARNER}dagger {RUN}",
    "play --spec spidr -o a.html": "unknown robot 'spidr'; did you mean 'spider'? (there are: ",
    "play --robot=tick --policy runs/none -o a.html": "cannot read runs/none: no such file\n",
    "play --legs 6 --robot=tick -o a.html": "--robot=tick: expected no robot with --spec or --legs\n",
    "play --robot=tick --arena a.png:9x9x1 -o a.html": "cannot read a.png: no such file or directory",
    "studio --policy runs/none": "cannot read runs/none: no such file\n",
    "evaluate --robot=tick --json=a.png": "unknown extension '.png' (there are: .json); arc-suite render writes",
    "transfer --policy ppo": "policy ppo: expected universal, or the folder of a run of many bodies\n",
    "transfer --task mimic": "task mimic: expected one that prescribes a gait\n",
    "export cpg": "policy cpg: expected the folder of a run, or universal with a body\n",
    "evaluate --policy tick-walk-ppo-0": "unknown policy 'tick-walk-ppo-0'; did you mean runs/tick-walk-ppo-0?\n",
    "card tick-walk-ppo-0": "tick-walk-ppo-0: no folder of a run; did you mean runs/tick-walk-ppo-0?\n",
    "card runs/tick-walk-ppo": "runs/tick-walk-ppo: no folder of a run; did you mean runs/tick-walk-ppo-0?\n",
    "build_model --legs 6 --tail=lon": "flag --tail=lon: expected own, short or long\n",
    "animate --legs 6 --tail long": "unknown flag 'tail'; arc-suite build_model --torso, --head and --tail, ",
    "build_model --legs 6 --name Krabbo": f"Body.name: {LOWER_CASE}, got 'Krabbo'; did you mean 'krabbo'?\n",
    "style --robot=tick --json=a.csv": "unknown extension '.csv' (there are: .json)\n",
    "style --robot=tick -o a.png": f"--output=a.png: {NO_FOLDER}; arc-suite render writes pictures",
    "train --robot=tick -o a.npz": f"--output=a.npz: {NO_FOLDER}\n",
    "design -o a.glb": f"--output=a.glb: {NO_FOLDER}; arc-suite animate writes .glb\n",
    "benchmark --results a.csv": f"--results=a.csv: {NO_FOLDER}\n",
    "export universal --runner a.onnx": f"--runner=a.onnx: {NO_FOLDER}; arc-suite export writes .onnx\n",
    "build_model --spec=spider --length l9_lower=2": "unknown link 'l9_lower'; did you mean 'l4_lower'? (there are: ",
}
LINES = CURED | OTHERS | MISPLACED | FIRST_HOUR | WRONG_CURES


@pytest.mark.parametrize(
    "command", tiers(LINES, CURED.__contains__, [*WRONG_CURES, *list(FIRST_HOUR)[::3]].__contains__)
)
def test_a_mistake_is_one_line(command, tmp_path):
    (tmp_path / "note.txt").write_text("hello")
    (tmp_path / "body.json").write_text('{"name": "x"}')
    (tmp_path / "my.json").write_text("{}")
    (tmp_path / "my_design.json").write_text('{"sketch": {}, "command": []}')
    (tmp_path / "my.clips.json").write_text('{"body": "x", "clips": []}')
    for name in ("ground.png", "page.html", "wave.py"):
        (tmp_path / name).touch()
    (tmp_path / "clip.glb").write_bytes(b"\x89glTF")
    (tmp_path / "model.onnx").write_bytes(b"\x08")
    (tmp_path / "broken.py").write_text("def make(:\n")
    (tmp_path / "folder").mkdir()
    (tmp_path / "gallery" / "bodies").mkdir(parents=True)
    (tmp_path / "gallery" / "bodies" / "a.json").touch()
    (tmp_path / "gallery" / "design.json").write_text('{"elites": []}')
    for run in ("tick", "tick-walk-ppo-0"):
        (tmp_path / "runs" / run).mkdir(parents=True)
        for name in ("config.json", "policy.npz"):
            (tmp_path / "runs" / run / name).write_text("{}")
    np.savez(tmp_path / "arrays.npz", zeros=np.zeros(3))
    np.save(tmp_path / "array.npy", np.zeros(3))
    files = sorted(tmp_path.iterdir())
    program, *_ = command.split()
    line = LINES[command] if LINES[command].startswith("arc-suite: ") else f"arc-suite {program}: {LINES[command]}"
    programs.refused(programs.arc_suite(*command.split(), cwd=tmp_path), line)
    assert sorted(tmp_path.iterdir()) == files
