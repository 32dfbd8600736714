"""Pages to play in: the ports of law, task and networks against Python, and what is in a page."""

import functools
import math
import pathlib
import re

import ground_files
import imports
import networks
import nodes
import numpy as np
import programs
import pytest
from page_data import data_of
from PIL import Image

from arc_suite.animation import pacing, pages, play_pages
from arc_suite.bodies import generator, universal
from arc_suite.cpg import leaps
from arc_suite.cpg.presets import PRESETS
from arc_suite.envs.setup import Setup
from arc_suite.models.kinematics import Legs
from arc_suite.policies import alone, network, policy
from arc_suite.robots import ROBOTS, gaits

OTHERS = [imports.quadruped(), imports.hexapod(), imports.body("a1_like.urdf")]
OTHERS += [imports.with_arm(), imports.on_its_floor()]
BODIES = {body.name: body for body in (*ROBOTS.values(), *map(generator.random_body, range(10)), *OTHERS)}
STEPS = 200  # 10 s for the robots, 4 s for those of others
BOUNDING = {"leaper": 48}  # steps: as it bounds, differences grow tenfold in ten

# Walks with turns, steps to either side and stops, each held as long; poses, shares of the room, and tempi of gaits.
SCRIPT = [(1.0, 0.0, 0.0), (0.6, 0.0, 0.4), (0.0, 0.0, 0.0), (0.0, 0.5, 0.0), (-0.5, 0.0, 0.0), (0.0, 0.0, -1.0)]
SCRIPT += [(0.5, -0.25, -0.25), (0.0, 0.0, 0.0)]
POSES = [np.zeros(6), np.eye(6)[4], -0.5 * np.eye(6)[0], 0.3 * np.eye(6)[5], np.array((0.3, 0.2, -0.2, 0.2, -0.1, 0.0))]
TEMPI = (1.0, 0.8, 1.2)

describe_creature = functools.cache(play_pages.creature)  # seconds a body, which several tests play


@pytest.fixture(scope="module")
def script(tmp_path_factory):
    path = pathlib.Path(__file__).parents[1] / "engines" / "closed_loop.js"
    return nodes.bundled(path, tmp_path_factory.mktemp("node"))


def commands(steps):
    """The commands of each step: velocities alone."""
    held = math.ceil(steps / len(SCRIPT))
    return [{"command": SCRIPT[step // held]} for step in range(steps)]


def upright(creature, command):
    """The commands of a velocity, the pose at rest and the body's own gait."""
    constants = creature["task"]["direction"]
    return {"command": command, "pose": [0.0] * 6, "gait": [*constants["gaits"]["own"], constants["frequency"]]}


def directions(steps, creature):
    """The commands of each step: velocities, poses within the body's room, and gaits that fit it."""
    constants = creature["task"]["direction"]
    low, high = np.transpose(constants["room"])
    numbers = [[*gait, tempo * constants["frequency"]] for gait in constants["gaits"].values() for tempo in TEMPI]
    asked, held = commands(steps), math.ceil(steps / len(SCRIPT))
    for step, each in enumerate(asked):
        shares = POSES[step // (held // 2) % len(POSES)]  # they change while a command holds, and when it does
        each["pose"] = (0.5 * np.where(shares < 0.0, -low, high) * shares).tolist()
        each["gait"] = numbers[2 * step // held % len(numbers)]
    return asked


def played(setup, driver, given):
    """The start of an episode of Python, and for each step its state after it, its action and what was observed."""
    environment, act = setup.load(seed=3), alone(driver)
    timestep, data = environment.reset(), environment.physics.data
    desired = timestep.observation.get("command", np.zeros(6))[:3]
    start = {"qpos": data.qpos.tolist(), "qvel": data.qvel.tolist(), "desired": desired.tolist()}
    positions, actions, observations = [], [], []
    for asked in given:
        for name, value in asked.items() if environment.task.definition.commands else ():
            environment.command(name, value)
        observations.append(timestep.observation)
        timestep = environment.step(act(timestep))
        assert not timestep.last()
        positions.append(data.qpos.copy())
        actions.append(data.ctrl[: len(setup.body.joint_names)].copy())
    return start, np.array(positions), np.array(actions), observations


def assert_walks_agree(script, body, steps, preset="steered"):
    """A body under commands goes where it goes in Python, and so do the actions: in closed loop, each by its own.

    Under stiff servos the solvers of two versions of MuJoCo take other ways to its tolerance.
    """
    tolerance = 1e-6 if body.source else 1e-9
    setup, creature = Setup.of(body, "directed", {"time_limit": 1e6}), play_pages.creature(body, "cpg", preset)
    given = directions(steps, creature)
    start, positions, actions, observations = played(setup, pacing.paced_demonstrator(setup.definition, preset), given)
    (found,) = nodes.run(script, [{"creature": creature, "ground": "level", "asked": given, **start}])
    np.testing.assert_allclose(found["positions"], positions, rtol=0.0, atol=tolerance)
    np.testing.assert_allclose(found["actions"], actions, rtol=0.0, atol=tolerance)
    for block in ("gait_clock", "command", "pose", "gait"):
        ported = [observation[block] for observation in found["observations"]]
        np.testing.assert_allclose(ported, [each[block] for each in observations], rtol=0.0, atol=10.0 * tolerance)
    assert np.ptp(positions[:, :2], axis=0).max() > 0.2 * body.torso.standing_height  # it does walk


@pytest.mark.slow
@nodes.needs_node
@pytest.mark.parametrize(
    ("name", "preset", "steps"),
    [
        ("tick", "steered", 64),
        pytest.param("leaper", "reactive", 40, marks=pytest.mark.long),
        pytest.param("random_4", "surefooted", 64, marks=pytest.mark.release),
        pytest.param("quadruped_15_kg", "braced", 64, marks=pytest.mark.release),
        ("quadruped_15_kg", "steered", 100),
        pytest.param("hexapod_2kg", "steered", 80, marks=pytest.mark.release),
        pytest.param("with_arm", "steered", 100, marks=pytest.mark.release),
        pytest.param("on_its_floor", "steered", 60, marks=pytest.mark.release),
    ],
)
def test_a_short_walk_is_that_of_python(script, name, preset, steps):
    assert_walks_agree(script, BODIES[name], steps, preset)


@pytest.mark.release
@nodes.needs_node
@pytest.mark.parametrize("name", BODIES)
def test_walks_of_ten_seconds_are_those_of_python(script, name):
    assert_walks_agree(script, BODIES[name], BOUNDING.get(name, STEPS))


@pytest.mark.slow
@nodes.needs_node
@pytest.mark.parametrize(
    ("name", "speed", "plays"), [("tick", 0.0, "jump"), pytest.param("queen", 1.0, "leap", marks=pytest.mark.release)]
)
def test_leaps_follow_the_keyframes_of_python(script, name, speed, plays):
    """Standing still a body jumps, walking it leaps; actions are those of the drive towards Python's targets."""
    body, pressed = ROBOTS[name], 60
    creature, law = (
        describe_creature(body),
        policy("cpg", body, "steered", task=Setup.of(body, "directed").definition).law,
    )
    legs, pose = Legs.of(law.body), tuple(law.legs.by_joint(law.rest_angles).tolist())
    if plays == "jump":
        leap = leaps.choose_jump(body, pose)
    else:
        leap = leaps.choose_leap(body, pose, PRESETS[name]["leaping"].choice)
    targets = leaps.leap_targets(body, legs, law.rest_angles, leap)
    asked = [upright(creature, [speed, 0.0, 0.0]) for _ in range(pressed + len(targets) + 40)]
    asked[pressed] |= {"leaps": True}
    episode = {"creature": creature, "ground": "level", "qvel": [], "desired": [0.0] * 3, "asked": asked}
    (found,) = nodes.run(script, [episode | {"qpos": creature["grounds"]["level"]["start"]}])
    crouched = leaps.lay_out_movement(
        body, legs, law.rest_angles, leap
    ).crouch_end  # until then joints go over from where they were
    steps = slice(pressed + crouched, pressed + len(targets) - 1)
    angles, speeds = (
        np.array([observation[block][first:] for observation in found["observations"][steps]])
        for block, first in (("posture", 5), ("velocities", 6))
    )
    aims = targets[crouched:-1], np.diff(targets, axis=0)[crouched:] / law.control_timestep
    np.testing.assert_allclose(found["actions"][steps], law.drive.actions(*aims, angles, speeds), rtol=0.0, atol=1e-9)
    places, height = np.array(found["positions"])[:, :3] / body.torso.standing_height, slice(pressed, None)
    assert places[height, 2].max() > places[pressed - 1, 2] + 0.3 and not any(found["falls"])
    assert places[-1, 2] == pytest.approx(places[pressed - 1, 2], abs=0.1)


def assert_networks_agree(script, setup, driver, name, tolerance=1e-9):
    """In states that Python went through, a network observes and does the same."""
    given = (
        commands(16) if setup.definition.commands else [{"command": (0.0, 0.0, 0.0)}] * 16
    )  # else they turn the course
    start, positions, actions, observations = played(setup, driver, given)
    creature = play_pages.creature(setup.body, name)
    episode = {"creature": creature, "ground": "level", "asked": given, "replayed": actions.tolist(), **start}
    (found,) = nodes.run(script, [episode])
    np.testing.assert_allclose(found["positions"], positions, rtol=0.0, atol=tolerance)
    for block in creature["policy"]["constants"]["blocks"]:
        ported = [observation[block] for observation in found["observations"]]
        np.testing.assert_allclose(
            ported, [observation[block] for observation in observations], rtol=0.0, atol=10.0 * tolerance
        )
    np.testing.assert_allclose(found["actions"], actions, rtol=0.0, atol=1e-5)  # float32: sums differ by processor


@pytest.mark.slow
@nodes.needs_node
def test_a_packaged_policy_is_that_of_python(script):
    excluded = {"exclude_blocks": ["contact_forces"]}
    assert_networks_agree(script, Setup.of("queen", "walk", excluded), policy("ppo", ROBOTS["queen"]), "ppo")


@pytest.mark.slow
@nodes.needs_node
def test_layers_of_all_kinds_and_all_blocks_are_those_of_python(script, tmp_path):
    made = networks.made("tick", "steer")
    # The others are those of a policy of any body.
    assert {node.operator for node in made.graph.nodes} == {
        *["Sub", "Mul", "Clip", "Linear", "LayerNorm", "Relu", "Elu", "Tanh"]
    }
    assert set(made.blocks) == {"posture", "velocities", "contact_forces", "gait_clock", "command"}
    network.save(tmp_path / "policy.npz", made)
    assert_networks_agree(script, made.setup, made, str(tmp_path))


@pytest.mark.slow
@nodes.needs_node
def test_a_network_of_servos_beside_an_arm_is_that_of_python(script, tmp_path):
    made = networks.made(BODIES["with_arm"], "steer")
    network.save(tmp_path / "policy.npz", made)
    assert_networks_agree(script, made.setup, made, str(tmp_path), tolerance=1e-6)


@pytest.mark.slow
@nodes.needs_node
@pytest.mark.parametrize("task", ["walk", "steer"])
def test_a_policy_of_any_body_is_that_of_python(script, tmp_path, task):
    body = BODIES["random_4"]
    made, setup = universal.load("universal", Setup.of(body, task).definition), Setup.of(body, task)
    network.save(tmp_path / "policy.npz", made)
    name = "universal" if task == "steer" else str(tmp_path)
    assert_networks_agree(script, setup, policy(name, body, task=setup.definition), name)


@pytest.mark.slow
@nodes.needs_node
@pytest.mark.parametrize(("name", "of_python", "tolerance"), [("tick", "ppo", 1e-4), ("queen", "cpg", 1e-6)])
def test_a_body_gets_up_as_in_python(script, name, of_python, tolerance):
    """By the policy of the package, or by `rising`; a network computes in float32."""
    setup, creature = Setup.of(name, "recover"), describe_creature(ROBOTS[name])
    given = [upright(creature, [0.0] * 3) for _ in range(12)]
    start, positions, actions, observations = played(setup, policy(of_python, name, task=setup.definition), given)
    episode = {"creature": creature, "ground": "level", "asked": given, "rises": True}
    (found,) = nodes.run(script, [episode | start | {"desired": [0.0] * 3}])
    for block, values in observations[1].items():
        np.testing.assert_allclose(found["observations"][1][block], values, atol=tolerance, err_msg=block)
    np.testing.assert_allclose(found["actions"][:4], actions[:4], rtol=0.0, atol=tolerance)
    np.testing.assert_allclose(found["positions"][:4], positions[:4], rtol=0.0, atol=tolerance)


@pytest.mark.slow
@nodes.needs_node
def test_a_body_on_its_back_gets_up_and_walks_on(script):
    creature = describe_creature(ROBOTS["tick"])
    start = creature["grounds"]["level"]["start"]
    steps = 200  # 10 s
    fallen = {"creature": creature, "ground": "level", "qvel": [], "desired": [0.0] * 3}
    fallen |= {"qpos": [0.0, 0.0, 0.15, 0.0, 1.0, 0.0, 0.0, *start[7:]]}
    fallen |= {"asked": [upright(creature, [1.0, 0.0, 0.0])] * steps}
    (path,) = nodes.run(script, [fallen])
    patience = creature["recovery"]["patience"]
    assert all(path["falls"][:patience]) and not any(path["falls"][-60:])
    ways = np.linalg.norm(np.diff(np.array(path["positions"])[-60:, :2], axis=0), axis=-1).sum()
    assert ways > 0.6 * 60 * creature["task"]["step"] * creature["task"]["units"][0]


@pytest.mark.long
@nodes.needs_node
def test_heights_on_bumps_are_those_of_python(script):
    """Contacts with height fields differ between versions of MuJoCo; heights over them do not."""
    arena = Setup.of("tick", "steer", {"arena": "bumps"}).definition.scene.arena
    creature = describe_creature(ROBOTS["tick"])
    places = np.random.default_rng(0).uniform((-20.0, -5.0), (20.0, 5.0), (20, 2))  # beyond the edges, too
    still = {
        "creature": creature,
        "ground": "bumps",
        "qvel": [],
        "desired": [0.0] * 3,
        "asked": [upright(creature, [0.0] * 3)],
    }
    pose = creature["grounds"]["bumps"]["start"][3:]
    episodes = [still | {"qpos": [*place, 1.0, *pose]} for place in places]
    heights = [path["observations"][0]["posture"][0] for path in nodes.run(script, episodes)]
    np.testing.assert_allclose(heights, 1.0 - arena.height(*places.T), rtol=0.0, atol=1e-12)
    assert np.ptp(heights) > 0.02


@pytest.mark.long
@nodes.needs_node
@pytest.mark.parametrize("name", ["hill.png", "yard.xml"])
def test_heights_of_ground_from_files_are_those_of_python(script, tmp_path, name):
    write = ground_files.write_png if name == "hill.png" else ground_files.write_yard
    word = write(tmp_path / name)
    creature = play_pages.creature(ROBOTS["tick"], arena=word)
    surface = Setup.of("tick", "steer", {"arena": word}).definition.scene.arena
    places = np.random.default_rng(0).uniform((-2.0, -2.0), (2.0, 2.0), (10, 2))
    still = {"creature": creature, "ground": name.partition(".")[0], "qvel": [], "desired": [0.0] * 3}
    still |= {"asked": [upright(creature, [0.0] * 3)]}
    pose = next(iter(creature["grounds"].values()))["start"][3:]
    paths = nodes.run(script, [still | {"qpos": [*place, 1.0, *pose]} for place in places])
    heights = [path["observations"][0]["posture"][0] for path in paths]
    np.testing.assert_allclose(heights, 1.0 - surface.height(*places.T), rtol=0.0, atol=1e-5)


@pytest.mark.slow
@nodes.needs_node
@pytest.mark.parametrize("ground", play_pages.GROUNDS)
def test_bodies_walk_from_their_start(script, ground):
    """Ahead as fast as the command says or nearly so, on either ground, and upside down is a fall."""
    body, steps = ROBOTS["tick"], 100
    creature = describe_creature(body)
    walk = {"qpos": creature["grounds"][ground]["start"], "qvel": [], "desired": [0.0, 0.0, 0.0]}
    walk |= {"creature": creature, "ground": ground, "asked": [upright(creature, [1.0, 0.0, 0.0])] * steps}
    over = walk | {"qpos": [0.0, 0.0, 0.1, 0.0, 1.0, 0.0, 0.0, *walk["qpos"][7:]]}
    over |= {"asked": [upright(creature, [0.0] * 3)] * 20}
    walked, lain = nodes.run(script, [walk, over])
    task = creature["task"]
    assert walked["positions"][-1][0] > 0.6 * steps * task["step"] * task["units"][0]
    assert not any(walked["falls"]) and lain["falls"][-1]


@pytest.mark.release
@nodes.needs_node
def test_the_largest_kick_fells_queen_in_half_of_the_tries(script):
    """As it walks, over eight directions and five phases of the gait: it lies until it would get up."""
    creature = describe_creature(ROBOTS["queen"])
    step = creature["task"]["step"]
    cycle = 1.0 / (creature["task"]["direction"]["frequency"] * step)  # steps
    walk = {"creature": creature, "ground": "level", "qvel": [], "desired": [0.0, 0.0, 0.0]}
    walk["qpos"] = creature["grounds"]["level"]["start"]
    tries = []
    for direction in np.arange(8) * math.pi / 4.0:
        for phase in np.arange(5) / 5.0:
            asked = [upright(creature, [1.0, 0.0, 0.0]) for _ in range(round(5.0 / step))]
            kick = creature["kick"] * np.array((math.cos(direction), math.sin(direction)))
            asked[round(2.0 / step + phase * cycle)]["kick"] = kick.tolist()
            tries.append(walk | {"asked": asked})
    lies = [sum(path["falls"]) >= creature["recovery"]["patience"] for path in nodes.run(script, tries)]
    assert 0.35 <= np.mean(lies) <= 0.65


def test_the_largest_kick_follows_from_how_a_body_stands():
    """Larger bodies of the same form by the square root of their size; a wider one needs more, and all some."""
    body = generator.generate(6, 3)
    larger_body = generator.scaled(body, 4.0)
    assert play_pages.largest_kick(larger_body) == pytest.approx(2.0 * play_pages.largest_kick(body), rel=0.02)
    heights = {name: kick_in_heights(each) for name, each in ROBOTS.items()}
    assert heights["queen"] == pytest.approx(1.8, rel=0.02) and heights["tick"] > 1.5 * heights["queen"]
    assert all(kick_in_heights(each) > 0.5 for each in OTHERS)


def kick_in_heights(body):
    """The largest kick of a body, sqrt(g h)."""
    return play_pages.largest_kick(body) / (9.81 * body.torso.standing_height) ** 0.5


def test_what_a_page_holds_of_a_body(monkeypatch):
    """Names of bodies come from files of others: they are text."""
    monkeypatch.setattr(pages, "read_built_file", lambda name: f"built {name}".encode())
    creature = describe_creature(ROBOTS["leaper"]) | {"name": "<leaper>"}
    page = play_pages.page([creature])
    assert "<title>&lt;leaper&gt;</title>" in page
    assert creatures_of(page) == [creature]
    assert page == play_pages.page([creature])
    assert all('integrator="Euler"' in ground["xml"] for ground in creature["grounds"].values())
    assert [creature["parts"][foot["part"]]["name"] for foot in creature["feet"]] == list(ROBOTS["leaper"].foot_names)
    choices = creature["task"]["direction"]
    assert choices["names"] == ["height", "forward", "left", "roll", "pitch", "yaw"] and len(choices["room"]) == 6
    assert list(choices["gaits"]) == ["own", "trot", "pace", "bound", "walk", "wave"]
    assert list(creature["policy"]["constants"]["leaps"]) == ["jump"]  # it gets too little ahead to leap: no key
    assert play_pages.creature(ROBOTS["leaper"], "ppo")["task"]["direction"] is None  # and no keys for it


@pytest.mark.parametrize(
    ("arena", "names"),
    [
        (None, ["level", "bumps", "slopes"]),
        ("flat", ["level", "bumps", "slopes"]),
        ("bumps", ["bumps", "level", "slopes"]),
        ("stairs", ["stairs", "level", "bumps", "slopes"]),
    ],
)
def test_a_page_begins_on_the_ground_that_is_asked_for(arena, names):
    assert list(play_pages.creature(ROBOTS["leaper"], arena=arena)["grounds"]) == names


@pytest.mark.parametrize("name", ["level", "bumps"])
def test_a_file_with_the_name_of_a_ground_is_its_own_ground(name, tmp_path):
    path = tmp_path / f"{name}.png"
    Image.fromarray(np.linspace(0, 255, 64).astype(np.uint8).reshape(8, 8)).save(path)
    grounds = play_pages.creature(ROBOTS["leaper"], arena=f"{path}:4x4x0.2")["grounds"]
    assert list(grounds) == [f"own {name}", "level", "bumps", "slopes"]
    assert np.ptp(grounds[f"own {name}"]["surface"]["heights"]) == pytest.approx(0.2)


def creatures_of(page):
    """What a page holds of its bodies, with the heights that they share in place."""
    data = data_of(page)
    for creature in data["bodies"]:
        for ground in creature["grounds"].values():
            numbers = re.findall('elevation="#([0-9]+)"', ground["xml"])
            for number in numbers:
                ground["xml"] = ground["xml"].replace(f'"#{number}"', f'"{data["shared"][int(number)]}"')
            if "surface" in ground:
                ground["surface"] = data["shared"][ground["surface"]]
    return data["bodies"]


def test_bodies_share_heights(monkeypatch):
    """Those of bodies of one height are in a page once, so that 27 bodies fit."""
    monkeypatch.setattr(pages, "read_built_file", lambda name: b"built")
    monkeypatch.setattr(play_pages, "_describe_leaps", lambda stepping: {})
    creatures = [play_pages.creature(generator.generate(legs, 2)) for legs in (4, 5)]
    page = play_pages.page(creatures)
    assert creatures_of(page) == creatures and len(data_of(page)["shared"]) == 3  # bumps, slopes and their surface
    assert len(pages.pack(data_of(page))) < 0.6 * len(pages.pack(creatures))
    assert [creature["counts"] for creature in creatures] == [{"legs": 4, "links": 2}, {"legs": 5, "links": 2}]


def test_walkers_are_bodies_by_legs_and_links():
    counts = [(len(body.legs), len(body.legs[0].links)) for body in play_pages.walkers()]
    assert counts == [(legs, links) for legs in range(4, 13) for links in (2, 3, 4)]
    refused = programs.arc_suite("play", "--robot=walkers", "--legs=6", "-o", "a.html")
    programs.refused(refused, "arc-suite play: --robot=walkers: expected no robot with --spec or --legs\n")


def test_a_page_begins_with_the_licenses(monkeypatch):
    monkeypatch.setattr(pages, "read_built_file", lambda name: b"[" + name.encode() + b"]")
    page = play_pages.page([describe_creature(ROBOTS["leaper"])])
    assert page.index('<meta charset="utf-8">') < 200  # where browsers look for it
    order = ["Apache License", "Third-party licenses", "Qhull", "-->", "[play.js]", "<body", 'id="engine"']
    places = [page.index(text) for text in order]
    assert places == sorted(places)


@pytest.mark.slow
@nodes.needs_viewer
def test_the_program_writes_a_page(tmp_path):
    out = programs.passed(programs.arc_suite("play", "--robot=queen", "-o", "queen.html", cwd=tmp_path))
    assert re.fullmatch(r"wrote queen.html, 4\.\d MB\n", out)
    page = (tmp_path / "queen.html").read_text()
    head = page[: page.index("<style>")]
    assert "Apache License" in head and "Third-party licenses" in head
    assert "Permission is hereby granted, free of charge" in head  # three.js's


def test_a_body_that_cannot_walk_has_no_page():
    queen = ROBOTS["queen"]
    high = queen.replace(name="high", torso=queen.torso.replace(standing_height=9.0))
    with pytest.raises(ValueError, match=r"^high cannot walk: "):
        play_pages.creature(high)


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        ((), "no file to write; say --output=FILE.html"),
        (("-o", "a.htm"), "unknown extension '.htm'; did you mean '.html'? (there are: .html)"),
        (("-o", "a.html", "--policy=zero"), "policy zero: a page runs cpg, ppo, universal, or one trained network"),
        (
            ("-o", "a.html", "--preset=sighted"),
            "preset 'sighted': a page runs steered, surefooted, braced, reactive, which follow a command by steps",
        ),
        (("-o", "a.html", "--policy=none/there.npz"), "cannot read none/there.npz: no such file"),
    ],
)
def test_errors_are_one_line(tmp_path, flags, message):
    done = programs.arc_suite("play", "--robot=tick", *flags, cwd=tmp_path)
    programs.refused(done, f"arc-suite play: {message}\n")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("task", "settings", "message"),
    [
        ("rough", {}, "observes scan, and a page has"),
        ("steer", {"actions": "position"}, "its actions are a position a joint, and a page takes torques"),
    ],
)
def test_networks_that_a_page_cannot_run(tmp_path, task, settings, message):
    made = networks.made("tick", task)
    network.save(tmp_path / "policy.npz", made._replace(setup=Setup.of("tick", task, settings)))
    with pytest.raises(ValueError, match=message):
        play_pages.creature(ROBOTS["tick"], str(tmp_path))


@pytest.mark.parametrize(
    ("body", "run"),
    [
        (ROBOTS["tick"], 1.75),
        (ROBOTS["leaper"], None),  # which gets slower
        pytest.param(generator.generate(9, 2), None, marks=pytest.mark.release),
        pytest.param(generator.generate(5, 3), 1.75, marks=pytest.mark.release),
    ],
    ids=["tick", "leaper", "9x2", "5x3"],
)
def test_a_run_is_faster_than_the_walk_or_there_is_none(body, run, script):
    creature = describe_creature(body)
    direction = creature["task"]["direction"]
    assert direction["run"] == run
    start = {"qpos": creature["grounds"]["level"]["start"], "qvel": [0.0] * (6 + len(body.joint_names))}
    distances = []
    for forward in (1.0, run or 1.75):
        pace = gaits.pace_at(forward)
        *offsets, duty = direction["gaits"]["own"]
        gait = [*offsets, duty + pace.duty_change, pace.tempo * direction["frequency"]]
        asked = [{"command": (forward, 0.0, 0.0), "pose": [0.0] * 6, "gait": gait}] * STEPS
        episode = {"creature": creature, "ground": "level", "asked": asked, "desired": [0.0] * 3, **start}
        (path,) = nodes.run(script, [episode])
        way = np.subtract(path["positions"][-1], path["positions"][STEPS // 3])[:2]  # five legs veer as they run
        assert way[0] > 0.9 * np.linalg.norm(way)
        distances.append(np.linalg.norm(way))
    assert (distances[1] > 1.1 * distances[0]) == (run is not None)
