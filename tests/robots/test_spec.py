"""Specs are frozen, validated data: what is malformed gets one line that names the field."""

import dataclasses
import math
import subprocess
import sys

import pytest
from refusals import refused

from arc_suite.robots import ROBOTS, spec_files
from arc_suite.robots.spec import (
    MAX_PALETTE_SEED,
    Ballast,
    Body,
    Foot,
    Joint,
    Leg,
    Link,
    Motor,
    Simulation,
    Solid,
    SpecError,
    Torso,
    TrackingCamera,
)

MOTOR = Motor(gear=100.0)
HIP = Joint(name="hip", axis=(0.0, 0.0, 1.0), range_deg=(-20.0, 30.0), armature=0.1, damping=0.5, motor=MOTOR)
KNEE = HIP.replace(name="knee", axis=(-1.0, 2.0, 0.5), range_deg=(-80.0, 10.0))
UPPER = Link(name="upper", end=(0.1, 0.2, 0.0), radius=0.05, joint=HIP)
LOWER = Link(name="lower", end=(0.0, 0.1, -0.3), radius=0.04, joint=KNEE)
FOOT = Foot(radius=0.03)
LEG = Leg(name="l1", mount=(0.2, 0.1, 0.0), yaw_deg=15.0, links=(UPPER, LOWER), foot=FOOT)
CHASSIS = Solid(name="chassis", shape="box", size=(0.2, 0.1, 0.05))
TORSO = Torso(standing_height=0.33, solids=(CHASSIS,))
SHELL = Ballast(name="shell", shape="sphere", size=(0.1,), mass=2.0)
CAMERA = TrackingCamera(position=(0.0, -3.0, 1.0))
BODY = Body(name="beast", torso=TORSO, legs=(LEG, LEG.mirrored("r1")), camera=CAMERA, density=10.0, ballast=(SHELL,))

NAME = "expected 1 to 32 characters out of [a-z0-9_], got "
RANGE = "Joint(hip).range_deg: expected low <= 0 <= high and low < high, got "
SHAPE = "Solid(chassis).shape: expected one of sphere, capsule, cylinder, ellipsoid, box, got "
LENGTH = "expected a number from 1e-06 to 100, got "


@pytest.mark.parametrize(
    ("spec", "field", "value", "message"),
    [
        # names
        (LEG, "name", "L1", f"Leg.name: {NAME}'L1'; did you mean 'l1'?"),
        (LEG, "name", "", f"Leg.name: {NAME}''"),
        (LEG, "name", "l1\n", f"Leg.name: {NAME}'l1\\n'; did you mean 'l1'?"),
        (LEG, "name", "a/b", f"Leg.name: {NAME}'a/b'"),
        (LEG, "name", "bein_ä", f"Leg.name: {NAME}'bein_ä'"),
        (LEG, "name", "a" * 33, f"Leg.name: {NAME}'{'a' * 33}'"),
        (BODY, "name", "x" * 1000, f"Body.name: {NAME}'{'x' * 56}..."),
        (UPPER, "name", None, f"Link.name: {NAME}None"),
        (FOOT, "name", 7, f"Foot.name: {NAME}7"),
        (CHASSIS, "name", "floor", "Solid(floor).name: 'floor' is what the body stands on"),
        # numbers
        (MOTOR, "gear", 0.0, "Motor.gear: expected a number from 1e-20 to 1e+30, got 0.0"),
        (MOTOR, "gear", "120", "Motor.gear: expected a number from 1e-20 to 1e+30, got '120'"),
        (MOTOR, "gear", True, "Motor.gear: expected a number from 1e-20 to 1e+30, got True"),
        (MOTOR, "gear", None, "Motor.gear: expected a number from 1e-20 to 1e+30, got None"),
        (HIP, "armature", -1e-9, "Joint(hip).armature: expected a number from 0 to 1e+35, got -1e-09"),
        (HIP, "damping", -1, "Joint(hip).damping: expected a number from 0 to 1e+35, got -1"),
        (HIP, "damping", math.nan, "Joint(hip).damping: expected a number from 0 to 1e+35, got nan"),
        (HIP, "damping", 1 + 2j, "Joint(hip).damping: expected a number from 0 to 1e+35, got a complex"),
        (FOOT, "radius", -0.1, f"Foot(foot).radius: {LENGTH}-0.1"),
        (FOOT, "radius", math.inf, f"Foot(foot).radius: {LENGTH}inf"),
        (FOOT, "radius", 10**400, f"Foot(foot).radius: {LENGTH}1{'0' * 56}..."),
        (UPPER, "radius", 0, f"Link(upper).radius: {LENGTH}0"),
        (TORSO, "standing_height", 1e300, f"Torso.standing_height: {LENGTH}1e+300"),
        (BODY, "density", 0.0, "Body(beast).density: expected a number from 1e-09 to 1e+09, got 0.0"),
        (SHELL, "mass", -2.0, "Ballast(shell).mass: expected a number from 1e-09 to 1e+09, got -2.0"),
        (LEG, "yaw_deg", 361.0, "Leg(l1).yaw_deg: expected a number from -360 to 360, got 361.0"),
        # vectors
        (HIP, "axis", (0.0, 0.0, 0.0), "Joint(hip).axis: expected a direction, got one of no length"),
        (HIP, "axis", (0.0, math.nan, 1.0), "Joint(hip).axis: expected a number from -1000 to 1000, got nan"),
        (HIP, "axis", (0.0, 1.0), "Joint(hip).axis: expected 3 numbers, got (0.0, 1.0)"),
        (HIP, "axis", "001", "Joint(hip).axis: expected 3 numbers, got '001'"),
        (HIP, "range_deg", (-200.0, 0.0), "Joint(hip).range_deg: expected a number from -180 to 180, got -200.0"),
        (HIP, "range_deg", (10.0, 20.0), f"{RANGE}(10.0, 20.0)"),
        (HIP, "range_deg", (0.0, 0.0), f"{RANGE}(0.0, 0.0)"),
        (LEG, "mount", (0.0, math.inf, 0.0), "Leg(l1).mount: expected a number from -100 to 100, got inf"),
        (UPPER, "end", (0.0, 0.0, 0.0), "Link(upper).end: expected a point away from the link's origin"),
        (UPPER, "end", {"x": 1.0}, "Link(upper).end: expected 3 numbers, got a dict"),
        (SHELL, "euler_deg", (0.0, 0.0), "Ballast(shell).euler_deg: expected 3 numbers, got (0.0, 0.0)"),
        (CAMERA, "xyaxes", (1.0, 0.0, 0.0), "TrackingCamera.xyaxes: expected 6 numbers, got (1.0, 0.0, 0.0)"),
        (CAMERA, "xyaxes", (1, 0, 0, 2, 0, 0), "TrackingCamera.xyaxes: expected a number from -1 to 1, got 2"),
        (CAMERA, "position", None, "TrackingCamera.position: expected 3 numbers, got None"),
        # shapes
        (CHASSIS, "shape", "mesh", f"{SHAPE}'mesh'"),
        (CHASSIS, "shape", [], f"{SHAPE}[]"),
        (CHASSIS, "size", (0.2, 0.1), "Solid(chassis).size: expected 3 lengths for a box, got 2"),
        (CHASSIS, "size", (), "Solid(chassis).size: expected 1 to 3 lengths, got ()"),
        (CHASSIS, "size", 0.2, "Solid(chassis).size: expected 1 to 3 lengths, got 0.2"),
        (CHASSIS, "size", (0.2, -0.1, 0.1), f"Solid(chassis).size: {LENGTH}-0.1"),
        # parts
        (UPPER, "joint", HIP.motor, "Link(upper).joint: expected a Joint, got a Motor"),
        (HIP, "motor", 120.0, "Joint(hip).motor: expected a Motor, got 120.0"),
        (BODY, "simulation", {"timestep": 0.002}, "Body(beast).simulation: expected a Simulation, got a dict"),
        (Simulation(), "timestep", 0.0, "Simulation.timestep: expected a number from 1e-06 to 0.1, got 0.0"),
        (Simulation(), "timestep", 0.02, "Simulation.contact_time: expected at least two timesteps, got 0.02"),
        (LEG, "foot", 0.05, "Leg(l1).foot: expected a Foot, got 0.05"),
        (LEG, "links", (), "Leg(l1).links: expected 1 to 16 Links, got 0"),
        (LEG, "links", (LOWER,) * 17, "Leg(l1).links: expected 1 to 16 Links, got 17"),
        (LEG, "links", LOWER, "Leg(l1).links: expected a sequence of Links, got a Link"),
        (LEG, "links", (UPPER, FOOT), "Leg(l1).links: expected a Link, got a Foot"),
        (LEG, "links", (UPPER, UPPER), "Leg(l1).links: the name 'upper' occurs twice"),
        (LEG, "links", (UPPER.replace(name="foot"),), "Leg(l1).links: the name 'foot' occurs twice"),
        (LEG, "links", (UPPER, LOWER.replace(joint=HIP)), "Leg(l1).links: the name 'hip' occurs twice"),
        (LEG, "links", (UPPER.replace(joint=None),), "Leg(l1).links: expected at least one link with a joint"),
        (TORSO, "solids", (), "Torso.solids: expected 1 to 64 Solids, got 0"),
        (TORSO, "solids", (CHASSIS, CHASSIS), "Torso.solids: the name 'chassis' occurs twice"),
        (BODY, "legs", (), "Body(beast).legs: expected 1 to 64 Legs, got 0"),
        (BODY, "legs", (LEG,) * 1_000_000, "Body(beast).legs: expected 1 to 64 Legs, got 1000000"),
        (BODY, "legs", (LEG, LEG), "Body(beast).legs: the name 'l1' occurs twice"),
        (BODY, "legs", [LEG, None], "Body(beast).legs: expected a Leg, got None"),
        (BODY, "ballast", (CHASSIS,), "Body(beast).ballast: expected a Ballast, got a Solid"),
        (BODY, "ballast", (SHELL.replace(name="chassis"),), "Body(beast).ballast: the name 'chassis' occurs twice"),
        (BODY, "torso", LEG, "Body(beast).torso: expected a Torso, got a Leg"),
        (BODY, "camera", LEG, "Body(beast).camera: expected a TrackingCamera, got a Leg"),
    ],
)
def test_a_malformed_field_is_named_in_one_line(spec, field, value, message):
    with refused(message, SpecError):
        spec.replace(**{field: value})


def test_names_that_meet_in_the_model_are_refused():
    # Leg "a" with link "b_c" and leg "a_b" with link "c" would both be the body a_b_c.
    one = LEG.replace(name="a", links=(UPPER.replace(name="b_c"), LOWER))
    other = LEG.replace(name="a_b", links=(UPPER.replace(name="c"), LOWER))
    with pytest.raises(SpecError, match=r"^Body\(beast\).legs: the name 'a_b_c' occurs twice$"):
        BODY.replace(legs=(one, other))
    with pytest.raises(SpecError, match=r"^Body\(beast\).legs: the name 'l1_upper' occurs twice$"):
        BODY.replace(ballast=(SHELL.replace(name="l1_upper"),))


def test_specs_are_frozen_equal_by_value_and_hashable():
    for spec in (MOTOR, HIP, UPPER, FOOT, LEG, CHASSIS, SHELL, TORSO, CAMERA, BODY):
        field = dataclasses.fields(spec)[0].name
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(spec, field, getattr(spec, field))
        assert spec.replace() == spec
        assert hash(spec.replace()) == hash(spec)
    with pytest.raises(TypeError, match="unexpected keyword argument 'color'"):
        LEG.replace(color="red")


def test_sequences_become_tuples_and_numbers_floats():
    leg = Leg(name="l1", mount=[0, 1, 0], links=[UPPER], foot=FOOT)
    assert leg.mount == (0.0, 1.0, 0.0)
    assert all(type(number) is float for number in leg.mount)
    assert leg.links == (UPPER,)


def test_a_mirrored_leg_stands_across_the_x_z_plane():
    right = LEG.mirrored("r1")
    assert right.name == "r1"
    assert right.mount == (0.2, -0.1, 0.0)
    assert right.yaw_deg == -15.0
    assert [link.end for link in right.links] == [(0.1, -0.2, 0.0), (0.0, -0.1, -0.3)]
    hip, knee = right.joints
    assert (hip.axis, hip.range_deg) == ((0.0, 0.0, 1.0), (-30.0, 20.0))  # a vertical axis stays, so its range turns
    assert (knee.axis, knee.range_deg) == ((1.0, 2.0, -0.5), (-80.0, 10.0))
    assert right.foot == LEG.foot
    assert right.mirrored("l1") == LEG
    assert (LEG.side, right.side) == ("left", "right")


def test_foot_position_follows_the_chain():
    # mount + the links' ends (0.1, 0.3, -0.3) turned by 15 degrees about z
    cos, sin = math.cos(math.radians(15.0)), math.sin(math.radians(15.0))
    expected = (0.2 + 0.1 * cos - 0.3 * sin, 0.1 + 0.1 * sin + 0.3 * cos, -0.3)
    assert LEG.foot_position == pytest.approx(expected, abs=1e-15)


def test_names_and_ranks_follow_the_order_of_the_legs():
    rear = LEG.replace(name="l2", mount=(-0.2, 0.1, 0.0))
    body = BODY.replace(legs=(rear, LEG.mirrored("r1"), LEG))
    assert body.joint_names == ("l2_hip", "l2_knee", "r1_hip", "r1_knee", "l1_hip", "l1_knee")
    assert body.foot_names == ("l2_foot", "r1_foot", "l1_foot")
    assert body.part_names[:4] == ("torso", "l2_upper", "l2_lower", "l2_foot")
    assert body.ranks == (1, 0, 0)


def test_spec_needs_the_standard_library_alone():
    code = "import sys, importlib.util as u; s = u.spec_from_file_location('spec', sys.argv[1]);"
    code += "m = sys.modules['spec'] = u.module_from_spec(s); s.loader.exec_module(m)"
    subprocess.run([sys.executable, "-I", "-S", "-c", code, sys.modules[Body.__module__].__file__], check=True)


def test_palettes_are_names_and_seeds():
    tick = ROBOTS["tick"]
    assert tick.replace(palette=MAX_PALETTE_SEED).palette == 2**31 - 1
    names = "moss, rust, bone, coral, night"
    choices = f"{names}, or a seed from 0 to 2147483647, or 1 to 5 colors such as #3a5f2b,#d8c48a"
    with refused(f"Body(tick).palette: expected one of {choices}, got 2147483648"):
        tick.replace(palette=2**31)


@pytest.mark.parametrize("colors", ["#3a5f2b", "#3A5F2B,#d8c48a", "#000000,#ffffff,#123456,#abcdef,#808080"])
def test_palettes_are_one_to_five_colors(colors):
    body = ROBOTS["tick"].replace(palette=colors)
    assert body.palette == colors.lower()
    text = spec_files.body_to_json(body)
    assert f'"palette": "{colors.lower()}"' in text and spec_files.body_from_json(text) == body


@pytest.mark.parametrize(
    ("value", "suggestion"),
    [
        ("3a5f2b,d8c48a", "; did you mean '#3a5f2b,#d8c48a'?"),
        ("#3a5f2b, #d8c48a", "; did you mean '#3a5f2b,#d8c48a'?"),
        ("#3a5f2b,", "; did you mean '#3a5f2b'?"),
        ("#abc", "; did you mean '#aabbcc'?"),
        ("0x3A5F2BFF", "; did you mean '#3a5f2b'?"),
        (["#3a5f2b", "#d8c48a"], "; did you mean '#3a5f2b,#d8c48a'?"),
        (",".join(6 * ["#111111"]), f"; did you mean '{','.join(5 * ['#111111'])}'?"),
        ("#3a5f2", ""),
        ("#3a5f2g", ""),
        ("#", ""),
        ("", ""),
        (",", ""),
        ((0.2, 0.4, 0.1), ""),
        ("٣٣٣٣٣٣", ""),
    ],
)
def test_other_colors_are_refused_with_the_nearest(value, suggestion):
    with pytest.raises(SpecError) as caught:
        ROBOTS["tick"].replace(palette=value)
    line = str(caught.value)
    assert line.startswith("Body(tick).palette: expected one of moss, ") and "\n" not in line
    assert line.partition(", got ")[2].partition("; did")[2] == suggestion.partition("; did")[2]
