"""Pages to play in: MuJoCo steps a body in the browser, and a policy follows keys, sticks and touch.

A page is one HTML file with nothing to fetch. `make web` builds its scripts, with three.js and MuJoCo's own
WebAssembly; the law `Stepping` is a port to JavaScript of what Python computes, with its constants, and trained
policies are graphs, which the page runs as they are.
"""

import base64
import functools
import html
import itertools
import json
import re
from collections.abc import Mapping, Sequence
from importlib import metadata
from typing import Any

import mujoco
import numpy as np

from arc_suite import models, policies, registry
from arc_suite.animation import pages, player_controls
from arc_suite.animation.pacing import paced_demonstrator
from arc_suite.arenas import ground_text
from arc_suite.arenas.mapped import sample_surface
from arc_suite.bodies import generator, universal
from arc_suite.bodies.universal import Universal
from arc_suite.cpg import Demonstrator, leaps
from arc_suite.cpg.limping import Limping
from arc_suite.cpg.presets import DEFAULTS
from arc_suite.cpg.selection import law_class, preset_of, presets_of, suited_preset
from arc_suite.cpg.stepping import Stepping
from arc_suite.envs.setup import Setup
from arc_suite.models import posture
from arc_suite.models.kinematics import Legs
from arc_suite.models.standing import GRAVITY, measure_standing, time_unit
from arc_suite.policies import other_libraries
from arc_suite.policies.network import Network
from arc_suite.robots import gaits
from arc_suite.robots.spec import Body
from arc_suite.simulation.episode_loop import play_episode
from arc_suite.tasks import Task, clock, readings
from arc_suite.tasks.blocks import PAGE_BLOCKS
from arc_suite.tasks.recover import LEAST_HEIGHT, LEAST_UPRIGHT

WALKERS = "walkers"  # stands for all bodies of `walkers`
_MIN_LINKS = 2  # of walkers
GROUNDS = {"level": "flat", "bumps": "bumps", "slopes": "slopes"}  # arenas by the names that a page shows
_READ_FROM_MODEL = ("flat", "bumps")  # arenas whose heights a page takes from the model

# Tasks whose command the player gives.
_DEMONSTRATOR_TASK = "directed"
_NETWORK_TASK = "steer"
_RECOVERY_TASK = "recover"
_PATIENCE = 0.5  # s for which a body lies before it gets up
_PAGE_LAWS = (Stepping, Limping)  # one law where the pose is by command, see web/law.js

# The largest kick. Queen as she walks falls in half of the tries: in 81 of 160, over directions and phases of the gait.
_KICK = 2.3  # multiple of the velocity at which an inverted pendulum passes the nearest edge of the feet
_MIN_RUN = 1.1  # times the speed of the walk: a run is as fast, or the page has none
_RUN_CYCLES = (3, 7)  # gait cycles between which speeds are measured
_LEAST_MARGIN = 0.3  # standing heights, from the center of mass to that edge


def page(creatures: Sequence[Mapping[str, Any]]) -> str:
    """Return a page to play in, given what `creature` returns for each body to choose from.

    Raises:
        ValueError: the scripts have not been built.
    """
    return pages.template("play.html").substitute(
        title=html.escape(", ".join(creature["name"] for creature in creatures)),
        licenses=licenses(),
        data=pages.pack(_share_heights(creatures)),
        engine=base64.b64encode(pages.read_built_file("mujoco.wasm.zlib")).decode(),
        script=pages.read_built_file("play.js").decode(),
    )


def walkers() -> list[Body]:
    """Return the bodies made to order that a page offers by sliders: all numbers of legs, by two links and more."""
    min_legs, max_legs = generator.LEG_RANGE
    _, max_links = generator.LINK_RANGE
    legs_and_links = itertools.product(range(min_legs, max_legs + 1), range(_MIN_LINKS, max_links + 1))
    return [generator.generate(legs, links) for legs, links in legs_and_links]


def _share_heights(creatures: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return creatures in whose grounds numbers stand for long lists of heights, and these lists; see web/data.js."""
    number_of_value: dict[str, int] = {}
    shared: list[Any] = []

    def share(value: Any) -> int:
        number = number_of_value.setdefault(json.dumps(value), len(shared))
        if number == len(shared):
            shared.append(value)
        return number

    def share_elevation(match: re.Match) -> str:
        return f'elevation="#{share(match[1])}"'

    bodies = []
    for creature_values in creatures:
        grounds = {}
        for name, ground in creature_values["grounds"].items():
            grounds[name] = ground | {"xml": re.sub('elevation="([^"]*)"', share_elevation, ground["xml"])}
            if "surface" in ground:
                grounds[name]["surface"] = share(ground["surface"])
        bodies.append({**creature_values, "grounds": grounds})
    return {"bodies": bodies, "shared": shared}


def licenses() -> str:
    """Return the license of MuJoCo and its notices of third parties, from its wheel, as text of an HTML comment."""
    wheel_files = metadata.files("mujoco") or ()
    license_files = sorted(file for file in wheel_files if file.parent.name == "licenses")
    texts = [file.read_text(encoding="utf-8") for file in license_files]
    all_texts = "\n\n".join(["This page contains MuJoCo and scripts of arc_suite.", *texts])
    return all_texts.replace("-->", "-- >")  # which would end the comment


def creature(body: Body, policy: str = "cpg", preset: str | None = None, arena: str | None = None) -> dict[str, Any]:
    """Return a body with its grounds and policy, as a page takes them: values that JSON has.

    Args:
        body: any.
        policy: cpg, for a demonstrator that follows the command; or the name of a trained policy, as for
            `policies.policy`.
        preset: preset of the demonstrator, of a law in `_PAGE_LAWS`; None stands for steered.
        arena: a further ground, on which the page begins; see `registry.arena_maker`.

    Raises:
        ValueError: a policy or preset that a page cannot run, or that does not fit the body.
        OSError: a policy's file cannot be read.
    """
    policies.check_preset(policy, preset)
    setup = Setup.of(body, _DEMONSTRATOR_TASK if policy == "cpg" else _NETWORK_TASK)
    command_task = setup.definition
    if policy == "cpg":
        task = command_task
        preset = preset or suited_preset(task)
        driver = _describe_law(task, preset)
        run = _choose_run(body, preset)
    else:
        network = _load_network(body, policy, command_task)
        task = network.setup.definition
        driver = _describe_network(network)
        run = None
    scene = command_task.scene
    feet = []
    for leg in body.legs:
        part_index = body.part_names.index(leg.full_name(leg.foot))
        feet.append({"part": part_index, "radius": leg.foot.radius})
    return pages.body_drawing(body) | {
        "name": body.name,
        "counts": _count_legs_and_links(body),
        "timestep": scene.control_timestep / scene.substeps,
        "substeps": scene.substeps,
        "feet": feet,
        "kick": largest_kick(body),
        "grounds": {name: _describe_ground(setup, word) for name, word in _grounds(arena).items()},
        "task": pages.to_json_values(_describe_task(task, command_task, run), decimals=None),
        "policy": pages.to_json_values(driver, decimals=None),
        "recovery": pages.to_json_values(_describe_recovery(body, task), decimals=None),
    }


def _count_legs_and_links(body: Body) -> dict[str, int] | None:
    """Return the numbers of legs and links of a body made to order; None for others."""
    legs = len(body.legs)
    links = len(body.legs[0].joints)
    is_in_range = all(
        low <= count <= high for count, (low, high) in ((legs, generator.LEG_RANGE), (links, generator.LINK_RANGE))
    )
    if not is_in_range or body != generator.generate(legs, links):
        return None
    return {"legs": legs, "links": links}


def largest_kick(body: Body) -> float:
    """Return the greatest change of a body's velocity by a kick, m/s; see `_KICK`."""
    pose = measure_standing(body)
    center_height = pose.center[2] - pose.soles[:, 2].min()  # m above the feet
    margin = max(pose.margin, _LEAST_MARGIN * pose.height)
    return float(_KICK * margin * (GRAVITY / center_height) ** 0.5)


# Grounds and tasks.


def _grounds(arena: str | None) -> dict[str, str]:
    """Return the arenas of a page by the names that it shows, the one that is asked for first."""
    if arena is None:
        return GROUNDS
    word = registry.arena_word(arena)
    names_of_grounds = {ground: name for name, ground in GROUNDS.items()}
    own_name = ground_text.name_of(word) if ground_text.is_text(word) else registry.bare_name(word)
    name = names_of_grounds.get(word) or own_name
    if GROUNDS.get(name, word) != word:
        name = f"own {name}"  # a file may have the name of a ground that each page has
    return {name: word, **GROUNDS}


def _describe_ground(setup: Setup, arena: str) -> dict[str, Any]:
    """Return the MJCF of a body in an arena, with the integrator of simulations, and where the body starts.

    Ground that is no plane or field around the start comes with its heights, as `surface`.
    """
    task, model = Setup.of(setup.body, setup.task, {"arena": arena}).prepare()
    xml = models.text(setup.body, task.scene.arena)
    if model.opt.integrator == mujoco.mjtIntegrator.mjINT_EULER:
        xml = xml.replace('integrator="implicitfast"', 'integrator="Euler"')
    data = mujoco.MjData(model)
    layout = task.scene.layout
    data.qpos[:] = readings.root_qpos(task.scene.standing, layout)
    mujoco.mj_forward(model, data)
    start_qpos = readings.root_qpos(task.raise_off_ground(task.read(data)), layout)
    ground = {"xml": xml, "start": pages.to_json_values(start_qpos, decimals=None)}
    if arena in _READ_FROM_MODEL:
        return ground
    surface = task.scene.arena.surface
    has_plane = (model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE).any()
    if surface is None or has_plane:
        surface = sample_surface(task.scene.arena, setup.body.torso.standing_height)
    return ground | {"surface": pages.to_json_values(surface)}


def _describe_task(task: Task, command_task: Task, run: float | None) -> dict[str, Any]:
    """Return what a page computes of a task: its frame, clock, units and health; see web/task.js.

    Args:
        task: task of the policy.
        command_task: task of the same body, whose units and health hold where the task has none.
        run: multiple of the command at which the body runs; None where it does not.
    """
    has_command = "command" in task.commands
    # Tasks with commands have a context with their units, and health, which others lack.
    context = task.context if has_command else command_task.context  # type: ignore[attr-defined]
    health = command_task.health  # type: ignore[attr-defined]
    (force_unit,) = context.force_unit  # (6,) forces, N, and torques, N m
    scene = command_task.scene
    layout = scene.layout
    joint_positions = np.r_[layout.joint_angles]  # indices in qpos
    return {
        "headed": has_command,
        "parts": np.r_[layout.parts],
        "root": layout.torso if layout.torso_place is None else layout.torso_place.root,
        "torso_place": None if layout.torso_place is None else layout.torso_place.in_root,
        "joints": joint_positions,
        "dofs": np.r_[layout.joint_velocities],
        "home": scene.standing[joint_positions],
        "step": scene.control_timestep,
        "turn": clock.TWO_PI * task.parameters.gait_frequency * scene.control_timestep,
        "units": context.units,
        "leak": context.leak,
        "force_unit": force_unit if has_command else np.ones(6),
        "weight": force_unit[5],
        "lowest": health.lowest * context.height,
        "lying": health.lying,
        "least_upright": health.least_upright,
        "direction": _describe_pose_and_gait(task, run) if player_controls.is_directed(task) else None,
    }


def _describe_pose_and_gait(task: Task, run: float | None) -> dict[str, Any]:
    """Return what a page computes of pose and gait, and what the player chooses from.

    See web/direction.js and web/panel.js.
    """
    body = task.scene.body
    reference = task.context.reference  # type: ignore[attr-defined]  # of tasks with commands
    return {
        "glide": reference.glide,
        "step": reference.step,
        "rate": time_unit(body) / reference.step,
        "names": posture.POSE_NAMES,
        "room": player_controls.pose_room(body),
        "frequency": task.parameters.gait_frequency,
        "gaits": player_controls.gaits_by_name(task),
        "paces": [list(pace) for pace in gaits.PACES_BY_SPEED],
        "run": run,
    }


# Demonstrators.


@functools.lru_cache(maxsize=64)
def _choose_run(body: Body, preset: str | None) -> float | None:
    """Return the multiple of the command at which a body runs: the quickest pace that is faster than its walk, or None.

    Args:
        body: any.
        preset: preset of the demonstrator.
    """
    setup = Setup.of(body, _DEMONSTRATOR_TASK)
    walk_speed = _measure_speed(setup, preset, 1.0)
    for name in ("run", "fast"):
        pace = gaits.PACES[name].speed
        if walk_speed > 0.0 and _measure_speed(setup, preset, pace) >= _MIN_RUN * walk_speed:
            return pace
    return None


def _measure_speed(setup: Setup, preset: str | None, forward: float) -> float:
    """Return the mean speed of a demonstrator, m/s, in the gait in which a page goes at a command; 0 if it falls."""
    environment = setup.load(seed=0)
    task = environment.task.definition
    policy = paced_demonstrator(task, preset)
    commands = player_controls.commands(task, (forward, 0.0, 0.0), np.zeros(6), player_controls.OWN_GAIT)
    steps_in_cycle = 1.0 / (task.parameters.gait_frequency * task.scene.control_timestep)
    start, end = (round(cycles * steps_in_cycle) for cycles in _RUN_CYCLES)
    positions = []
    for timestep in play_episode(environment, policies.alone(policy), max_steps=end):
        if timestep.first():
            for name, value in commands.items():
                environment.command(name, value)
        positions.append(environment.physics.data.qpos[:2].copy())
    environment.close()
    if len(positions) <= end:
        return 0.0
    seconds = (end - start) * task.scene.control_timestep
    return float(np.linalg.norm(positions[end] - positions[start]) / seconds)


def _describe_law(task: Task, preset: str) -> dict[str, Any]:
    """Return the constants of a demonstrator's law; a ValueError if a page cannot run it."""
    presets = presets_of(task.scene.body)
    if law_class(preset_of(task.scene.body, preset)) not in _PAGE_LAWS:
        names = [name for name, parameters in presets.items() if law_class(parameters) in _PAGE_LAWS]
        raise ValueError(f"preset {preset!r}: a page runs {', '.join(names)}, which follow a command by steps")
    stepping = paced_demonstrator(task, preset).law
    return {"kind": "law", "constants": stepping.constants() | {"leaps": _describe_leaps(stepping)}}


def _describe_recovery(body: Body, task: Task) -> dict[str, Any] | None:
    """Return how a body gets up: by its policy of the package, or by the law `rising`; see web/recovery.js.

    Args:
        body: the body.
        task: task of the page's policy; None is returned for one without a command, in whose frame nothing gets up.
    """
    if "command" not in task.commands:
        return None
    recover = Setup.of(body, _RECOVERY_TASK).definition
    if policies.is_packaged(body, _RECOVERY_TASK):
        driver = _describe_network(policies.policy("ppo", body, task=recover))  # type: ignore[arg-type]
    else:
        driver = {"kind": "rising", "constants": Demonstrator(recover).law.constants()}
    height = recover.unwrapped.height  # type: ignore[attr-defined]
    return {
        "policy": driver,
        "lowest": LEAST_HEIGHT * height,
        "least_upright": LEAST_UPRIGHT,
        "steps": recover.unwrapped.hold_steps,  # type: ignore[attr-defined]
        "patience": max(1, round(_PATIENCE / recover.scene.control_timestep)),
    }


def _describe_leaps(stepping: Stepping) -> dict[str, Any]:
    """Return the leaps that a body can, by name.

    Each has the targets of joints (steps, joints), rad, and the step at which the crouch ends.
    """
    body = stepping.body
    legs = Legs.of(body)  # whose joints use all of their ranges in a leap
    rest_joints = tuple(legs.by_joint(stepping.rest_angles).tolist())
    forward_leaps = presets_of(body)["leaping"].choice + DEFAULTS["leaping"].choice
    leap_of_name = {}
    choices = {
        "jump": lambda: leaps.choose_jump(body, rest_joints),
        "leap": lambda: leaps.choose_leap(body, rest_joints, forward_leaps),
    }
    for name, choose in choices.items():
        try:
            leap = choose()
        except ValueError:
            continue  # and the page has no key for it
        leap_of_name[name] = {
            "crouched": leaps.lay_out_movement(body, legs, stepping.rest_angles, leap).crouch_end,
            "targets": leaps.leap_targets(body, legs, stepping.rest_angles, leap),
        }
    return leap_of_name


# Trained networks.


def _load_network(body: Body, name: str, command_task: Task) -> Network:
    """Return a trained network by name; a ValueError if a page cannot run it.

    Args:
        body: body that it moves.
        name: as for `policies.policy`.
        command_task: task of the body, with a command that the player gives.
    """
    policy = policies.policy(name, body, task=command_task if name == universal.NAME else None)
    if other_libraries.find(name):
        policy = policies.load_network(name)  # the same policy as a network of this package
    if isinstance(policy, Universal):  # acts in the task that it was trained in
        trained_tasks = policy.network.setup.tasks
        task = _NETWORK_TASK if _NETWORK_TASK in trained_tasks else trained_tasks[0]
        policy = universal.for_body(policy.network, Setup.of(body, task))
    if not isinstance(policy, Network):
        raise ValueError(f"policy {name}: a page runs cpg, ppo, universal, or one trained network")
    for block in policy.blocks:
        if block not in PAGE_BLOCKS:
            available = ", ".join(PAGE_BLOCKS)
            raise ValueError(f"policy {name}: observes {block}, and a page has {available} alone")
    actions = policy.setup.definition.actions
    if actions != command_task.actions:
        raise ValueError(
            f"policy {name}: its actions are a {actions} a joint, and a page takes {command_task.actions}s"
        )
    return policy


def _describe_network(network: Network) -> dict[str, Any]:
    """Return the graph of a network, with its arrays in base64."""
    nodes = [[node.operator, *node.inputs] for node in network.graph.nodes]
    arrays = {name: _encode_array(values) for name, values in network.graph.arrays.items()}
    return {"kind": "graph", "constants": {"blocks": list(network.blocks), "nodes": nodes, "arrays": arrays}}


def _encode_array(values: np.ndarray) -> dict[str, Any]:
    """Return an array with its numbers in base64, little-endian."""
    little_endian = values.astype(values.dtype.newbyteorder("<"))
    data = base64.b64encode(little_endian.tobytes()).decode()
    return {"type": values.dtype.name, "shape": values.shape, "data": data}
