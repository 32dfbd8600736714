"""Clips and their files: what is in the bytes is what the body does."""

import functools
import itertools
import math
import warnings

import gltf_reader
import numpy as np
import pytest
from poses import placed
from refusals import refused
from tiers import never, tiers

import arc_suite
from arc_suite import policies, rotations
from arc_suite.animation import clips as export
from arc_suite.animation.clips import bounds, foot_contacts, getting_up, loops, metadata, passages, recordings
from arc_suite.animation.clips.catalog import CLIPS, WalkLoop
from arc_suite.animation.clips.recorder import Recorder
from arc_suite.bodies.families import sound_body
from arc_suite.bodies.generator import random_body
from arc_suite.envs.setup import Setup
from arc_suite.policies import policy
from arc_suite.robots import ROBOTS, spec_files
from arc_suite.simulation.model import compile_model

PRESETS = [(robot, preset) for robot in ROBOTS for preset in ("slow", "medium", "fast", "tuned")]
# Tests share the clips of a robot. `make check` has one walk alone.
EACH = tiers(ROBOTS, never, lambda robot: robot == "tick")
NAMES = ("walk", "turn_left", "start", "stop", "idle")
SHORT = Setup.of("tick", "walk", {"time_limit": 1.0})
slow = functools.partial(pytest.param, marks=pytest.mark.slow)


@functools.cache
def made(robot, *names):
    return {clip.name: clip for clip in export.clips(Setup.of(robot, "steer"), names or NAMES, fps=30)}


@functools.cache
def read(robot, rig="skin", root_motion="both"):
    return gltf_reader.read(export.glb(ROBOTS[robot], list(made(robot).values()), rig, root_motion, "test"))


def of_rest(robot):
    """The file of a robot without clips."""
    return gltf_reader.read(export.glb(ROBOTS[robot], []))


def feet_of(body, qpos):
    """Places (samples, feet, 3) of the feet in the world."""
    return placed(body, qpos, body.foot_names)[0]


def assert_kinematics(body, file, clips):
    """The file's nodes are where MuJoCo has the clips' poses, to 1e-5 m, and turn as there, moving and in place."""
    axes = [1, 2, 0]
    near = 1e-5 * max(1.0, body.torso.standing_height)
    for clip in clips:
        for name in (animation["name"] for animation in file.json["animations"]):
            if not name.startswith(clip.name):
                continue
            in_place = "in_place" in name or not clip.moves
            motion = clip.motion._replace(root=0.0 * clip.motion.root) if in_place else clip.motion
            world = gltf_reader.played(file, name)
            world = np.stack(np.broadcast_arrays(*(world[part] for part in body.part_names)), axis=1)
            places, turns = placed(body, motion.poses(), body.part_names)
            assert abs(world[..., :3, 3] - places[..., axes]).max() < near
            turns = turns[..., axes, :][..., axes]
            given, wanted = (each @ each[0].swapaxes(-1, -2) for each in (world[..., :3, :3], turns))
            assert abs(given - wanted).max() < 1e-5


GET_UPS = {"get_up": (-1.0, -0.7), "get_up_side": (-0.4, 0.4), "get_up_belly": (0.7, 1.0)}


@pytest.mark.long
@pytest.mark.parametrize(("robot", "names"), [("tick", GET_UPS), ("queen", ["get_up_belly"])])
def test_a_robot_gets_up_from_falls_and_steps_to_rest(robot, names):
    """Tick gets up by a policy of the package, Queen by the demonstrator `rising`."""
    clips = made(robot, *names, "idle")
    idle = clips["idle"].motion.pose(0)
    for name in names:
        least, largest = GET_UPS[name]
        motion = clips[name].motion
        assert least <= rotations.upright(motion.quaternions[0]) <= largest + 1e-9
        assert not clips[name].loops and not clips[name].moves
        assert bounds.measure(ROBOTS[robot], motion).still_seconds < (0.25 if robot == "tick" else 0.9)
        assert clips[name].slide <= 0.05 * ROBOTS[robot].torso.standing_height
        # The middle legs come down, which Tick's policy holds up.
        feet = {event.foot for event in clips[name].foot_contacts if event.time > motion.seconds - 2.0}
        assert robot != "tick" or feet >= {"l2_foot", "r2_foot"}
        last = motion.pose(-1)
        np.testing.assert_allclose(last.position, idle.position, atol=1e-6)
        np.testing.assert_allclose(last.joints, idle.joints, atol=1e-6)
        assert abs(last.quaternion @ idle.quaternion) == pytest.approx(1.0)  # q and -q are one orientation


@pytest.mark.long
def test_a_body_whose_feet_would_glide_to_rest_does_not_get_up():
    with pytest.warns(UserWarning, match="a foot slides by 0.2. standing heights as it gets up from its belly"):
        assert "get_up_belly" not in made("leaper", "get_up_belly", "idle")


@pytest.mark.long
def test_a_body_whose_legs_do_not_reach_the_ground_does_not_get_up_from_its_back():
    with refused("it does not get up from its back within 4 s"):
        getting_up.get_up(ROBOTS["queen"], rest=None, lies_on="back")


def test_feet_leave_the_ground_in_a_jump_and_come_down():
    clip = made("tick", "jump", "idle")["jump"]
    for foot in ROBOTS["tick"].foot_names:
        events = [contact.event for contact in clip.foot_contacts if contact.foot == foot]
        assert events and events == [foot_contacts.LIFT_OFF, foot_contacts.TOUCH_DOWN] * (len(events) // 2)


def test_the_bytes_of_a_walk_hold_its_kinematics():
    clips = export.clips(Setup.of("tick", "steer"), ["walk"], fps=30)
    assert_kinematics(ROBOTS["tick"], gltf_reader.read(export.glb(ROBOTS["tick"], clips)), clips)


@pytest.mark.parametrize("rig", export.RIGS)
@pytest.mark.parametrize("robot", EACH)
def test_the_bytes_hold_the_kinematics(robot, rig):
    assert_kinematics(ROBOTS[robot], read(robot, rig), made(robot).values())


@pytest.mark.long
@pytest.mark.parametrize("name", tiers(spec_files.EXAMPLES, never, lambda name: name == "crab"))
def test_every_example_has_the_default_clips(name):
    body = spec_files.load_body(name)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        clips = export.clips(Setup.of(body, "steer"), export.DEFAULT)
    assert_kinematics(body, gltf_reader.read(export.glb(body, clips)), clips)
    assert len(clips) + len(caught) == len(export.DEFAULT)
    assert {"walk", "start", "stop", "idle"} <= {clip.name for clip in clips}
    assert all(np.degrees(clip.motion.seam) <= 2.0 for clip in clips if clip.loops)


@pytest.mark.parametrize("robot", EACH)
def test_the_skin_is_where_the_rigid_parts_are(robot):
    """A vertex of the skin, moved by its bone, is a vertex of the rig of rigid parts."""
    skin, nodes = read(robot), read(robot, "nodes")
    bones, parts = (gltf_reader.played(file, "walk_loop") for file in (skin, nodes))
    (mesh,) = skin.json["meshes"]
    joints = skin.json["skins"][0]["joints"]
    inverses = skin.arrays[skin.json["skins"][0]["inverseBindMatrices"]].swapaxes(-1, -2)
    frame = 17
    places = [bones[skin.json["nodes"][joint]["name"]] for joint in joints]
    bent = np.stack([place[min(frame, len(place) - 1)] for place in places]) @ inverses

    def moved(file, primitive, matrices):
        points = file.arrays[primitive["attributes"]["POSITION"]]
        return np.einsum("...ij,...j->...i", matrices[..., :3, :3], points) + matrices[..., :3, 3]

    one, other = [], []
    for primitive in mesh["primitives"]:
        one.append(moved(skin, primitive, bent[skin.arrays[primitive["attributes"]["JOINTS_0"]][:, 0]]))
    for node in nodes.json["nodes"]:
        for primitive in nodes.json["meshes"][node["mesh"]]["primitives"] if "mesh" in node else ():
            place = parts[node["name"]]
            other.append(moved(nodes, primitive, place[min(frame, len(place) - 1)]))
    one, other = np.concatenate(one), np.concatenate(other)
    assert one.shape == other.shape
    np.testing.assert_allclose(one.mean(axis=0), other.mean(axis=0), atol=1e-6)
    np.testing.assert_allclose(np.cov(one.T), np.cov(other.T), atol=1e-6)
    np.testing.assert_allclose(one.max(axis=0), other.max(axis=0), atol=1e-6)


@pytest.mark.parametrize("robot", EACH)
def test_the_skin_is_bound_in_idle(robot):
    """And, in a file without that clip, as the body stands, on the ground."""
    for file in (read(robot), of_rest(robot)):
        points = [file.arrays[each["attributes"]["POSITION"]] for each in file.json["meshes"][0]["primitives"]]
        assert abs(np.concatenate(points)[:, 1].min()) < 0.01 * ROBOTS[robot].torso.standing_height
    bound, idle = gltf_reader.played(read(robot), None), gltf_reader.played(read(robot), "idle_loop")
    for name, place in bound.items():
        np.testing.assert_allclose(place[0], idle[name][0], atol=1e-6)


@pytest.mark.parametrize("robot", EACH)
def test_names_and_hierarchy(robot):
    file, body = read(robot), ROBOTS[robot]
    nodes = file.json["nodes"]
    (skin,) = file.json["skins"]
    sidecar = export.sidecar(body, list(made(robot).values()))
    swinging = sidecar["swinging_bones"]
    parents = {nodes[child]["name"]: node["name"] for node in nodes for child in node.get("children", ())}
    assert sidecar["bones"] == {"root": None} | parents
    assert list(sidecar["bones"]) == [nodes[joint]["name"] for joint in skin["joints"]]
    assert [nodes[joint]["name"] for joint in skin["joints"]] == ["root", *body.part_names, *swinging]
    names = [animation["name"] for animation in file.json["animations"]]
    loops = ["walk_loop", "walk_in_place_loop", "turn_left_loop", "turn_left_in_place_loop"]
    assert names == [*loops, "start", "start_in_place", "stop", "stop_in_place", "idle_loop"]
    root = file.node("root")
    assert nodes[root].keys() == {"name", "children"}  # no turning, no scale
    assert [nodes[child]["name"] for child in nodes[root]["children"]] == ["torso"]
    for leg in body.legs:
        above = "torso"
        for part in (*leg.links, leg.foot):
            assert file.node(leg.full_name(part)) in nodes[file.node(above)]["children"]
            above = leg.full_name(part)
    for bone in swinging:
        assert file.node(bone) in nodes[file.node("torso")]["children"]
    for animation in file.json["animations"]:
        way = gltf_reader.played(file, animation["name"], [0.0, 0.5])["root"][:, :3, 3]
        root_moves = not animation["name"].endswith(("in_place", "in_place_loop", "idle_loop"))
        assert (way[1] != way[0]).any() == root_moves
        figures = sidecar["clips"][animation["name"]]
        assert figures["root_moves"] == root_moves
        assert animation["extras"] == figures
        assert figures["fps"] == 30.0 and figures["frames"] == round(figures["seconds"] * 30.0) + 1


def test_colors_are_linear_and_what_glows_is_emissive():
    materials = {material["name"]: material for material in of_rest("leaper").json["materials"]}
    red, green, blue, alpha = materials["trim"]["pbrMetallicRoughness"]["baseColorFactor"]  # sRGB 0.85, 0.08, 0.06
    np.testing.assert_allclose((red, green, blue, alpha), (0.6920, 0.0072, 0.0048, 1.0), atol=1e-4)
    assert "emissiveFactor" not in materials["trim"]
    assert materials["glow"]["emissiveFactor"][0] == pytest.approx(0.7)


@pytest.mark.slow
def test_root_motion_is_chosen():
    clips = list(made("tick").values())
    for root_motion, names in (("moving", ["walk_loop"]), ("in_place", ["walk_in_place_loop"])):
        file = gltf_reader.read(export.glb(ROBOTS["tick"], clips[:1], "skin", root_motion))
        assert [animation["name"] for animation in file.json["animations"]] == names
        assert list(export.sidecar(ROBOTS["tick"], clips[:1], root_motion)["clips"]) == names


@pytest.mark.parametrize("robot", EACH)
def test_a_loop_closes_in_the_bytes(robot):
    file = read(robot)
    for name in ("walk_in_place_loop", "turn_left_in_place_loop", "idle_loop"):
        for channel in file.animation(name)["channels"]:
            values = file.arrays[file.animation(name)["samplers"][channel["sampler"]]["output"]]
            assert (values[0] == values[-1]).all()


@pytest.mark.parametrize("robot", EACH)
def test_bones_of_ornaments_swing_and_are_as_in_the_next_clip_at_ends(robot):
    file, clips = read(robot), list(made(robot).values())
    springs = export.sidecar(ROBOTS[robot], clips)["swinging_bones"]
    assert springs
    for bone, spring in springs.items():
        assert 0.0 < spring["damping"] < 1.0 and 0.0 < spring["frequency"] < 10.0
        turns = {
            name: in_torso(file, name, bone) for name in ("walk_loop", "turn_left_loop", "start", "stop", "idle_loop")
        }
        rest, walking = turns["idle_loop"][0], turns["walk_loop"][0]
        assert 1.0 < max(degrees_between(turn, walking) for turn in turns["walk_loop"]) < 45.0
        assert max(degrees_between(turn, rest) for turn in turns["start"]) > 3.0
        for name in ("walk_loop", "turn_left_loop", "idle_loop"):
            np.testing.assert_allclose(turns[name][0], turns[name][-1], atol=1e-12)
            steps = [degrees_between(one, other) for one, other in itertools.pairwise(turns[name])]
            assert steps[-1] < 1.5 * max(steps[:-1]) + 0.1  # it goes on over the seam
        for name, end, neighbor in (
            ("start", 0, rest),
            ("start", -1, walking),
            ("stop", 0, walking),
            ("stop", -1, rest),
        ):
            np.testing.assert_allclose(turns[name][end], neighbor, atol=1e-6)


def in_torso(file, name, bone):
    """Matrices of a bone in the torso's frame, in each frame of an animation."""
    world = gltf_reader.played(file, name)
    torso, turns = np.broadcast_arrays(world["torso"][:, :3, :3], world[bone][:, :3, :3])
    return torso.swapaxes(-1, -2) @ turns


def degrees_between(one, other):
    return float(np.degrees(np.arccos(((one * other).sum() - 1.0).clip(-2.0, 2.0) / 2.0)))


@pytest.mark.slow
def test_reduced_keys_move_it_the_same():
    """Within what a tenth of a degree in each joint of a leg and 0.001 standing heights of the torso amount to."""
    clips, body = list(made("tick").values()), ROBOTS["tick"]
    files = [gltf_reader.read(export.glb(body, clips, reduced=reduced)) for reduced in (False, True)]
    counts = [
        sum(len(file.arrays[each["input"]]) for a in file.json["animations"] for each in a["samplers"])
        for file in files
    ]
    assert counts[1] < 0.58 * counts[0]
    for clip in ("walk_loop", "stop"):
        times = files[0].arrays[files[0].animation(clip)["samplers"][-1]["input"]]
        one, other = (gltf_reader.played(file, clip, times) for file in files)
        for foot in body.foot_names:
            assert abs(one[foot][:, :3, 3] - other[foot][:, :3, 3]).max() < 0.01 * body.torso.standing_height
        assert (one["root"][-1] == other["root"][-1]).all()


@pytest.mark.parametrize("robot", EACH)
def test_the_root_goes_as_fast_as_is_told(robot):
    file = read(robot)
    for name in ("walk_loop", "turn_left_loop"):
        figures = file.animation(name)["extras"]
        root = gltf_reader.played(file, name)["root"]
        x, _, z = root[:, :3, 3].T
        path = np.hypot(np.diff(x), np.diff(z)).sum()
        speed = math.hypot(figures["forward_speed"], figures["left_speed"])
        assert path / figures["seconds"] == pytest.approx(speed, rel=1e-3)
        turn = np.unwrap(np.arctan2(root[:, 0, 2], root[:, 2, 2]))
        assert (turn[-1] - turn[0]) / figures["seconds"] == pytest.approx(figures["turn_rate"], abs=1e-4)
        assert root[:, 1, 3].tolist() == [0.0] * len(root)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "sign"), [("turn_left", 1.0), ("turn_right", -1.0)])
def test_clips_go_ahead_and_to_their_side(name, sign):
    clip = (made("tick") if name in NAMES else made("tick", name))[name]
    root = gltf_reader.played(gltf_reader.read(export.glb(ROBOTS["tick"], [clip])), f"{name}_loop")["root"]
    assert root[-1, 2, 3] > 0.1
    assert sign * root[-1, 0, 3] > 0.01


def test_forward_is_z_and_left_is_x():
    rest = gltf_reader.played(of_rest("queen"), None)
    assert rest["l1_foot"][0, 0, 3] > 0.0 > rest["r1_foot"][0, 0, 3]
    assert rest["l1_foot"][0, 2, 3] > rest["l3_foot"][0, 2, 3]


@pytest.mark.long
@pytest.mark.parametrize(
    ("robot", "preset"), tiers(PRESETS, never, lambda robot, preset: (robot, preset) == ("leaper", "tuned"))
)
def test_presets_return(robot, preset):
    """Within half a degree before the seam is mended; in the walk's strides; two events a foot and cycle for tuned."""
    body = ROBOTS[robot]
    (clip,) = export.clips(Setup(body), ["walk"], preset=preset, weight=0.0)
    assert np.degrees(clip.motion.seam) <= 0.5
    environment = arc_suite.load(body, "walk", {"random": 0})
    recording = recordings.record(environment, policy("cpg", body, preset), 200, 700)
    # Of the torso, whose sway is taken out by a mean over a gait cycle.
    period = loops.period(recording)
    samples, sums = round(period / recording.time_step), recording.poses[:, :2].cumsum(axis=0)
    path = (sums[samples:] - sums[:-samples]) / samples
    speed = np.hypot(*np.diff(path, axis=0).T).mean() / recording.time_step
    # A stride, as time is stretched to whole frames: by less than one.
    cycle = clip.motion.seconds / clip.cycles
    assert np.hypot(*clip.motion.twist[:2]) * cycle == pytest.approx(speed * period, rel=0.01)
    assert cycle == pytest.approx(period, abs=0.5 / 30.0 / clip.cycles + 1e-9)
    if preset == "tuned":
        assert len(clip.foot_contacts) == 2 * len(body.legs) * clip.cycles
        (showcase,) = export.clips(Setup.of(body, "steer"), ["tuned"])
        np.testing.assert_array_equal(showcase.motion.joints, clip.motion.joints)


@pytest.mark.long
@pytest.mark.parametrize("seed", tiers(range(20), never, lambda seed: seed == 0))
def test_random_bodies_step_once_a_cycle(seed):
    body = random_body(seed)
    (clip,) = export.clips(Setup.of(body, "steer"), ["walk"])
    falls = [(contact.foot, contact.event) for contact in clip.foot_contacts]
    for foot in body.foot_names:
        for event in (foot_contacts.TOUCH_DOWN, foot_contacts.LIFT_OFF):
            assert falls.count((foot, event)) == clip.cycles


@pytest.mark.long
@pytest.mark.parametrize("robot", EACH)
def test_clips_are_in_step(robot):
    """All begin with the scheduled touchdown of the first foot, which comes down within 0.15 cycles of it."""
    clips = made(robot)
    first = ROBOTS[robot].foot_names[0]
    assert clips["walk"].cycles == clips["turn_left"].cycles == 1
    for name in ("walk", "turn_left"):
        clip = clips[name]
        (down,) = (e.time for e in clip.foot_contacts if (e.foot, e.event) == (first, foot_contacts.TOUCH_DOWN))
        assert min(down, clip.motion.seconds - down) <= 0.15 * clip.motion.seconds
        times = [contact.time for contact in clip.foot_contacts]
        assert times == sorted(times) and times[-1] < clip.motion.seconds


@pytest.mark.parametrize("robot", EACH)
def test_clips_connect_and_last_whole_frames(robot):
    """A stop begins with the walk's first pose and ends with idle's, a start the other way round."""
    clips = made(robot)
    for clip in clips.values():
        assert clip.motion.seconds * 30.0 == pytest.approx(round(clip.motion.seconds * 30.0), abs=1e-9)
    for before, after in (("walk", "stop"), ("stop", "idle"), ("idle", "start"), ("start", "walk")):
        for one, other in zip(clips[before].motion.pose(-1), clips[after].motion.pose(0), strict=True):
            np.testing.assert_allclose(one, other, atol=1e-6)


@pytest.mark.slow
def test_a_blend_space_has_clips_to_a_side():
    walk, idle = made("tick")["walk"], made("tick")["idle"]
    clips = [walk, walk._replace(name="strafe_left"), idle]
    points = export.sidecar(ROBOTS["tick"], clips)["blend"]["strafing"]["points"]
    assert [point["animation"] for point in points] == ["walk_loop", "strafe_left_loop", "idle_loop"]
    assert export.sidecar(ROBOTS["tick"], [walk, idle])["blend"] == {}


@pytest.mark.parametrize("robot", EACH)
def test_the_sidecar_has_blend_spaces_and_tells_missing_steps(robot):
    body, clips = ROBOTS[robot], list(made(robot).values())
    told = export.sidecar(body, clips)
    plane = told["blend"]["turning"]
    assert plane["axes"] == ["turn_rate", "forward_speed"]
    for point in plane["points"]:
        figures = told["clips"][point["animation"]]
        assert point["at"] == [figures["turn_rate"], figures["forward_speed"]]
    assert [point["animation"] for point in plane["points"]] == ["walk_loop", "turn_left_loop", "idle_loop"]
    assert list(told["blend"]) == ["turning"]  # without clips to a side the points of the other plane lie on a line
    assert told["clips"]["walk_loop"]["missing_steps"] == {}
    walk = made(robot)["walk"]
    lame = walk._replace(foot_contacts=tuple(e for e in walk.foot_contacts if e.foot != body.foot_names[1]))
    assert export.sidecar(body, [lame])["clips"]["walk_loop"]["missing_steps"] == {body.foot_names[1]: 1}
    assert told["clips"]["walk_loop"]["extra_steps"] == {} and metadata.describe_odd_steps(walk) == ""
    first = next(event for event in walk.foot_contacts if event.event == foot_contacts.TOUCH_DOWN)
    hasty = walk._replace(foot_contacts=(*walk.foot_contacts, first))
    assert export.sidecar(body, [hasty])["clips"]["walk_loop"]["extra_steps"] == {first.foot: 1}
    line = f"walk: touchdowns in 1 gait cycle: {first.foot} 2; docs/bodies.md: limits"
    assert metadata.describe_odd_steps(hasty) == line


@pytest.mark.slow
def test_starts_and_stops_go_straight_ahead_and_meet_their_neighbors():
    """The root neither turns nor drifts, and comes as far."""
    names = ("walk", "start", "stop", "idle")
    clips = {clip.name: clip for clip in export.clips(Setup.of("tick", "steer"), names, fps=30, straight=True)}
    for name in ("start", "stop"):
        veering, straight = made("tick")[name].motion, clips[name].motion
        assert veering.root[:, 1:].any() and not straight.root[:, 1:].any()
        assert straight.root[-1, 0] == pytest.approx(veering.root[-1, 0], rel=0.05)
    for before, after in (("walk", "stop"), ("stop", "idle"), ("idle", "start"), ("start", "walk")):
        for one, other in zip(clips[before].motion.pose(-1), clips[after].motion.pose(0), strict=True):
            np.testing.assert_allclose(one, other, atol=1e-6)


@pytest.mark.long
def test_what_is_played_from_rest_begins_or_ends_with_idle():
    clips = made("tick", "walk", "idle", "hit_front", "limp", "rise", "jump", "death", "turn_180", "attack")
    rest, body = clips["idle"].motion.pose(0), ROBOTS["tick"]
    for name, ends in (
        ("hit_front", (0, -1)),
        ("attack", (0, -1)),
        ("rise", (-1,)),
        ("jump", (0, -1)),
        ("death", (0,)),
    ):
        for end in ends:
            for one, other in zip(clips[name].motion.pose(end), rest, strict=True):
                np.testing.assert_allclose(one, other, atol=1e-6)
        assert not clips[name].loops and not clips[name].moves
    heights = {name: clip.motion.positions[:, 2] / rest.position[2] for name, clip in clips.items()}
    assert heights["death"][-1] < 0.6 and heights["rise"][0] < 0.6 < 1.3 < heights["jump"].max()
    assert (
        np.ptp(feet_of(body, clips["attack"].motion.poses())[..., 2], axis=0).max() > 0.3 * body.torso.standing_height
    )
    downs = [each for each in clips["attack"].foot_contacts if each.event == foot_contacts.TOUCH_DOWN]
    assert len({each.foot for each in downs}) == 1
    told = export.sidecar(body, list(clips.values()))["clips"]
    over = {name: figures["additive_over"] for name, figures in told.items() if "additive_to" in figures}
    assert over == {"hit_front": ["idle"], "limp_loop": ["walk"]}
    assert clips["turn_180"].motion.root[-1, 2] == pytest.approx(np.pi, abs=1e-9)
    for end in (0, -1):
        for one, other in zip(clips["turn_180"].motion.pose(end), rest, strict=True):
            np.testing.assert_allclose(one, other, atol=1e-6)
    assert 0.0 < told["walk_loop"]["slip"] < 0.15 and "slip" not in told["idle_loop"]
    # The failing leg moves less than it does in the walk, so that the difference undoes its steps. It follows the sway.
    walk, limp = made("tick")["walk"].motion.joints, clips["limp"].motion.joints
    swing = [np.ptp(joints[:, :3], axis=0).max() for joints in (walk, walk + limp[: len(walk)] - rest.joints)]
    assert swing[1] < 0.6 * swing[0]


@pytest.mark.slow
def test_what_is_too_far_from_the_walk_is_left_out(monkeypatch):
    monkeypatch.setattr(passages, "_MAX_MEETING_SEAM", 1e-6)
    with pytest.warns(UserWarning, match="^tick, clip stop is left out: its pose is 0 degrees from that of the walk"):
        (walk,) = export.clips(Setup.of("tick", "steer"), ["walk", "stop"], left_out=(left_out := {}))
    assert walk.name == "walk"
    assert left_out == {"stop": "its pose is 0 degrees from that of the walk or of idle, more than 0"}
    assert export.sidecar(ROBOTS["tick"], [walk], left_out=left_out)["left_out"] == left_out


@pytest.mark.parametrize("robot", EACH)
def test_soles_stand_on_the_ground(robot):
    body = ROBOTS[robot]
    for name in ("walk", "turn_left"):
        clip = made(robot)[name]
        soles = feet_of(body, clip.motion.poses())[..., 2] - [leg.foot.radius for leg in body.legs]
        stance = np.zeros(soles.shape, bool)
        for leg, foot in enumerate(body.foot_names):
            events = [contact for contact in clip.foot_contacts if contact.foot == foot]
            for time_of_down in (e.time for e in events if e.event == foot_contacts.TOUCH_DOWN):
                later = [e.time for e in events if e.event == foot_contacts.LIFT_OFF and e.time > time_of_down]
                end = min(later, default=clip.motion.seconds)
                stance[:, leg] |= (clip.times >= time_of_down) & (clip.times <= end)
        assert abs(np.median(soles[stance])) < 0.002 * body.torso.standing_height


@pytest.mark.parametrize("robot", EACH)
def test_idle_breathes_on_its_feet(robot):
    body, clip = ROBOTS[robot], made(robot)["idle"]
    assert clip.cycles == 0 and not clip.foot_contacts and not clip.moves
    height = body.torso.standing_height
    feet = feet_of(body, clip.motion.poses())
    assert np.ptp(feet, axis=0).max() < (0.035 if robot == "bastion" else 0.012) * height  # which has two joints a leg
    assert abs(feet[..., 2] - [leg.foot.radius for leg in body.legs]).max() < 0.012 * height
    least_breath = {"bastion": 0.025, "leaper": 0.04}.get(robot, 0.06)  # Leaper's soles slide in more
    assert np.ptp(clip.motion.positions[:, 2]) > least_breath * height
    ranges = compile_model(body).jnt_range[1:]
    assert (clip.motion.joints >= ranges[:, 0] - 1e-9).all() and (clip.motion.joints <= ranges[:, 1] + 1e-9).all()


@pytest.mark.slow
def test_variants_of_idle_look_around_and_set_feet_anew():
    body, clips = ROBOTS["tick"], made("tick", "idle", "idle_look", "idle_settle")
    for clip in clips.values():
        for one, other in zip(clip.motion.pose(-1), clips["idle"].motion.pose(0), strict=True):
            np.testing.assert_allclose(one, other, atol=1e-6)
    assert np.ptp(rotations.yaw(clips["idle_look"].motion.quaternions)) > 0.3
    rises = np.ptp(feet_of(body, clips["idle_settle"].motion.poses())[..., 2], axis=0)
    stepping = {
        foot for foot, rise in zip(body.foot_names, rises, strict=True) if rise > 0.1 * body.torso.standing_height
    }
    assert len(stepping) == 2 and {contact.foot for contact in clips["idle_settle"].foot_contacts} == stepping


@pytest.mark.parametrize("robot", EACH)
def test_a_stop_walks_and_then_stands(robot):
    motion = made(robot)["stop"].motion
    speeds = np.hypot(*np.diff(motion.root[:, :2], axis=0).T) / motion.time_step
    asked = arc_suite.load(robot, "steer").task.definition.context.units[0]
    assert speeds[0] > 0.5 * asked
    assert speeds[-5:].mean() < 0.1 * asked
    assert abs(np.diff(motion.joints[-10:], axis=0)).max() < np.radians(1.0)


@pytest.mark.long
@pytest.mark.parametrize("robot", tiers(ROBOTS, never, lambda robot: robot == "tick"))
def test_between_frames_a_clip_is_near_the_physics(robot):
    """Played at every substep, parts are within 6 mm of where substeps have them."""
    body = ROBOTS[robot]
    fine = export.clips(Setup(body), ["walk"], fps=1000.0 / 2.0)[0]
    coarse = gltf_reader.read(export.glb(body, export.clips(Setup(body), ["walk"])))
    world = gltf_reader.played(coarse, "walk_loop", fine.times)
    feet = feet_of(body, fine.motion.poses())
    for leg, foot in enumerate(body.foot_names):
        miss = np.linalg.norm(world[foot][:, :3, 3] - feet[:, leg][:, [1, 2, 0]], axis=-1)
        assert miss.max() < 0.006


def test_the_recording_is_the_episode_to_the_bit():
    environment = arc_suite.load("tick", "walk", {"random": 0})
    recording = recordings.record(environment, policy("cpg", "tick", "tuned"), 10, 5)
    act = policies.alone(policy("cpg", "tick", "tuned"))
    environment = arc_suite.load("tick", "walk", {"random": 0})
    timestep, poses = environment.reset(), []
    for _ in range(15):
        timestep = environment.step(act(timestep))
        poses.append(environment.physics.data.qpos.copy())
    np.testing.assert_array_equal(recording.poses[:: recording.substeps], poses[9:])


@pytest.mark.parametrize("setting", ["kicks", "force"])
def test_a_recording_of_a_body_that_is_pushed_is_refused(setting):
    environment = arc_suite.load("tick", "steer", {"random": 0, setting: 0.5})
    with refused("it is moved by more than its controls, as by kicks, which clips leave out"):
        recordings.record(environment, policy("cpg", "tick", "steered"), 10, 130)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"names": ["wlak"]}, "unknown clip 'wlak'; did you mean 'walk'?"),
        ({"names": []}, "clips: expected one or more of walk, slow, fast, run, turn_left, turn_right, forward_left, "),
        ({"names": ["walk", "walk"]}, "clips: expected each once"),
        ({"names": ["idle"]}, "tick, clip idle: the task walk has no command"),
        ({"names": ["refined"], "setup": Setup.of("spider", "steer")}, "spider, clip refined: spider has no preset "),
        ({"names": ["walk"], "fps": 0.0}, "fps: expected a number from 1 to 1000"),
        slow({"names": ["walk"], "policy": "zero"}, "tick, clip walk: the pose does not return within"),
        slow({"names": ["walk"], "policy": "random"}, "tick, clip walk: "),
        ({"names": ["walk"], "setup": SHORT}, "tick, clip walk: the episode ends after 20"),
        ({"names": ["walk"], "setup": Setup.of("tick", "shoved")}, "task shoved: expected kicks=0 and force=0, as "),
        ({"names": ["walk"], "setup": Setup.of("tick", "steer", {"force": 0.1})}, "task steer: expected kicks=0 and "),
    ],
)
def test_errors_are_one_line(arguments, message):
    with refused(message, begins=True):
        export.clips(**{"setup": Setup.of("tick"), **arguments})


@pytest.mark.release
@pytest.mark.parametrize("robot", ROBOTS)
def test_every_clip_can_be_made(robot):
    body = ROBOTS[robot]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        clips = {clip.name: clip for clip in export.clips(Setup.of(body, "steer"), list(CLIPS))}
    # Leaper cannot jump, leap or sway; the strides of Bastion to a side alternate.
    assert len(clips) + len(caught) == len(CLIPS) and len(caught) <= 6
    gltf_reader.read(export.glb(body, list(clips.values())))
    units = arc_suite.load(body, "steer").task.definition.context.units
    for name, clip in clips.items():
        if isinstance(spec := CLIPS[name], WalkLoop) and name not in ("fast", "run", "limp_walk"):
            missed = (clip.motion.twist - spec.command * units) / units
            assert abs(missed).max() < 0.27, name
    speeds = [clips[name].motion.twist[0] for name in ("slow", "walk", "fast") if name in clips]
    assert all(faster > 1.1 * slower for slower, faster in itertools.pairwise(speeds))


@pytest.mark.slow
def test_a_leg_that_sags_for_long_limps_in_a_loop():
    recorder = Recorder(Setup.of(sound_body(15), "steer"), "cpg", None)
    gait = recorder.record_walk((1.0, 0.0, 0.0), failing=0)
    assert loops.find_closings(gait.recording, gait.cycle, 1)[1].seam < 0.25 * loops.MAX_SEAM
    sound = recorder.record_walk((1.0, 0.0, 0.0))
    assert gait.phase != sound.phase and len(gait.recording.poses) == len(sound.recording.poses)
    # Feet of both gaits touch down at the same phase.
    touchdowns = []
    for recording in (gait, sound):
        begin, cycle = recording.samples_to_touchdown(0), round(gait.cycle / gait.recording.time_step)
        touchdowns.append(foot_contacts.sole_heights(recorder.body, recording.recording.poses[begin:][:cycle]))
    legs = slice(1, None)  # without the leg that fails
    assert np.corrcoef(touchdowns[0][:, legs].ravel(), touchdowns[1][:, legs].ravel())[0, 1] > 0.9
