"""The architecture: imports point downwards only, and go round nowhere."""

import ast
import functools
import graphlib
import pathlib
import subprocess
import sys

import pytest

import arc_suite

PACKAGE = pathlib.Path(arc_suite.__file__).parent

# From the ground up: a module imports its own room and those above it in this list. What stands in
# one row leans on nothing in it.
ROOMS = (
    ("checks", "rotations", "markers", "files", "versions", "paper"),
    ("archives",),  # files of arrays
    ("robots",),  # what moves
    ("arenas",),  # where
    ("models",),  # spec -> MJCF
    ("simulation",),  # MuJoCo runs
    ("tasks",),  # reward, observation, termination
    ("registry",),  # names of all three
    ("envs",),  # the faces
    ("cpg",),  # demonstrators
    ("registration",),  # robots and tasks of other packages
    ("policies",),  # who acts
    ("evaluation",),
    ("data",),
    ("style",),
    ("tuning",),
    ("export",),  # to take away
    ("design",),  # creatures found by search
    ("agents",),  # who learns
    ("studies",),  # tables of runs
    ("studio",),  # a creature is designed while it walks
    ("cli",),  # programs
    ("__main__",),  # that Python starts by name
)
HEIGHTS = {room: height for height, rooms in enumerate(ROOMS) for room in rooms}

# What the lower rooms may import in addition to the standard library and arc_suite; the longest name that fits counts.
THIRD_PARTY = {
    "checks": {"numpy"},
    "rotations": set(),
    "markers": {"numpy"},
    "files": set(),
    "archives": {"numpy"},
    "paper": set(),
    "versions": {"packaging"},
    "robots": set(),
    "robots.generator": {"numpy"},
    "robots.mirror": {"numpy"},
    "robots.varied": {"numpy"},
    "arenas": {"numpy", "dm_control"},
    "arenas.arena": {"dm_control"},
    "models": {"numpy", "mujoco", "dm_control"},
    "simulation": {"numpy", "mujoco", "dm_control", "glfw", "OpenGL"},
    "simulation.device": {"numpy", "mujoco", "jax"},
    "tasks": {"numpy"},
    "registry": set(),
    "envs": {"numpy", "mujoco", "dm_control", "dm_env", "gymnasium", "shimmy", "glfw"},
    "envs.mjx": {"numpy", "jax"},
    "envs.randomization": {"jax"},
    "envs.sb3": {"numpy", "gymnasium", "stable_baselines3"},
    "cpg": {"numpy"},
    "registration": {"gymnasium"},
    "policies": {"numpy", "dm_env"},
    "policies.network": {"numpy"},
    "policies.onnx_file": {"numpy", "onnx"},
    "policies.sb3_file": {"numpy", "torch", "stable_baselines3"},
    "evaluation.statistics": {"numpy"},
    "agents": {"numpy", "gymnasium", "tqdm"},
    "agents.networks": {"numpy", "jax"},
    "agents.architectures": {"numpy", "jax"},
    "agents.plots": {"numpy", "matplotlib"},
    "agents.off_policy": {"numpy", "jax"},
    "agents.soft_actor_critic": {"numpy", "jax", "optax"},
    "agents.dagger": {"numpy", "jax", "optax"},
    "agents.bc": {"numpy", "jax", "optax"},
    "agents.collecting": {"numpy"},
    "agents.on_policy": {"numpy", "jax"},
    "agents.proximal_policy": {"numpy", "jax", "optax"},
    "agents.worlds": {"numpy", "jax"},
    "agents.hyperparameters": set(),
    "studies": {"numpy", "minari", "matplotlib"},
    "studies.cluster": {"submitit"},
    "studies.publication": {"numpy", "gymnasium"},
    "studies.runner": {"numpy", "tqdm"},
    "studio": {"numpy"},
    "studio.saving": {"numpy", "imageio"},
    "studio.view": {"numpy", "viser"},
    "studio.charts": {"numpy", "viser", "PIL"},
    "studio.page": {"viser"},
    "style.metrics": {"numpy"},
    "style.colours": set(),
    "style.strips": {"numpy", "PIL"},
    "design": {"numpy"},
    "design.gallery": {"numpy", "PIL"},
    "export": {"numpy", "mujoco"},
    "export.films": {"numpy", "imageio", "imageio_ffmpeg", "PIL"},
    "export.gltf": {"numpy"},
    "export.shapes": {"numpy"},
    "export.pages": {"numpy"},
    "export.root_motion": {"numpy"},
}

# Modules of the suite that these may import, and no others.
INSIDE = {
    "rotations": set(),
    "paper": set(),
    "robots.spec": set(),
    "robots.queen": {"robots.spec"},
    "robots.bastion": {"robots.spec"},
    "robots.tick": {"robots.spec"},
    "robots.leaper": {"robots.spec"},
    "robots.mirror": {"robots.spec"},
    "arenas.arena": set(),
    "tasks.clock": set(),
    "tasks.readings": {"arenas"},
    "tasks.sensors": set(),
    "tasks.terms": {"checks", "tasks.readings"},
    "tasks.mirrors": {"robots.mirror"},
    "tasks.contract": {
        *("arenas", "markers", "robots.mirror", "robots.spec"),
        *("tasks.mirrors", "tasks.parameters", "tasks.readings"),
    },
    "tasks.modifiers": {"checks", "robots.spec"},
    "tasks.noise": {"models.sizing", "robots.spec"},
    "cpg.law": set(),
    "cpg.kinematics": {"robots.spec"},
    "cpg.presets": {
        *("cpg.balancing", "cpg.planner", "cpg.prescribed", "cpg.sighted", "cpg.steering"),
        "robots.gaits",
    },
    "evaluation.statistics": set(),
    "style.metrics": {"rotations", "style.tracks"},
    "style.colours": set(),
    "export.gltf": set(),
    "export.shapes": set(),
}


@functools.cache
def trees():
    """The syntax of every module, by name without `arc_suite.`; "" is the package itself."""
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE).with_suffix("").parts
        found[".".join(part for part in parts if part != "__init__")] = ast.parse(path.read_text())
    return found


def imported(tree):
    """Everything that a module imports, wherever in its text, by full name."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are absolute"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def inside(tree):
    """The modules of the suite that a module imports."""
    for target in imported(tree):
        top, _, name = target.partition(".")
        if top == "arc_suite":
            yield name if name in trees() else name.rpartition(".")[0]


def outside(tree):
    """The packages that a module imports in addition to the standard library and the suite."""
    tops = {target.partition(".")[0] for target in imported(tree)}
    return tops - {"arc_suite"} - sys.stdlib_module_names


def room(name):
    return name.partition(".")[0]


def modules():
    """Every module but the package itself, which hands on what its users need."""
    return [name for name in trees() if name]


def test_every_module_has_a_room():
    assert {room(name) for name in modules()} == set(HEIGHTS)


@pytest.mark.parametrize("name", modules())
def test_imports_point_downwards(name):
    for target in inside(trees()[name]):
        if room(name) == "cli" and not target:
            continue  # programs use the suite as its users do
        assert target, f"{name} imports arc_suite itself"
        lower = HEIGHTS[room(target)] < HEIGHTS[room(name)]
        assert lower or room(target) == room(name), f"{name} imports {target}"


def test_no_import_goes_round_inside_rooms_either():
    graphlib.TopologicalSorter({name: set(inside(tree)) - {name} for name, tree in trees().items()}).prepare()


@pytest.mark.parametrize(
    "name", [name for name in modules() if any(f"{name}.".startswith(f"{k}.") for k in THIRD_PARTY)]
)
def test_lower_rooms_need_little(name):
    nearest = max((key for key in THIRD_PARTY if f"{name}.".startswith(f"{key}.")), key=len)
    assert outside(trees()[name]) <= THIRD_PARTY[nearest]


@pytest.mark.parametrize("name", INSIDE)
def test_what_stands_alone(name):
    assert set(inside(trees()[name])) <= INSIDE[name]


def test_tables_name_what_is_there():
    assert THIRD_PARTY.keys() | INSIDE.keys() <= trees().keys()


def test_only_tasks_and_registration_know_one_task_from_another():
    """Drivers get tasks from the registry; registration knows walk's tables of parameters."""
    texts = {f"tasks.{path.stem}" for path in (PACKAGE / "tasks").glob("*.py")}
    contract = {"tasks.__init__", "tasks.contract", "tasks.clock", "tasks.readings", "tasks.terms", "tasks.fitting"}
    contract |= {"tasks.mirrors", "tasks.modifiers", "tasks.modified", "tasks.noise"}  # of any task
    contract |= {"tasks.parameters", "tasks.sensors", "tasks.energy", "tasks.tokens"}
    particular = texts - contract
    assert {"tasks.walk", "tasks.commanded", "tasks.suite"} <= particular
    for name in modules():
        if room(name) not in ("tasks", "registration"):
            assert not particular & set(inside(trees()[name])), name


def test_import_is_light():
    heavy = (
        "torch",
        "jax",
        "stable_baselines3",
        "shimmy",
        "matplotlib",
        "imageio",
        "viser",
        "arc_suite.animation.clips",
    )
    code = f"import sys, arc_suite; print([m for m in {heavy} if m in sys.modules])"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"
    assert result.stderr == ""
