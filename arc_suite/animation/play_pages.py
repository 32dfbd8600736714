"""Pages to play in: MuJoCo steps a body in the browser, and a policy follows keys, sticks and touch.

A page is one HTML file with nothing to fetch. `make web` builds its scripts, with three.js and MuJoCo's own
WebAssembly; the law `Directed` is a port to JavaScript of what Python computes, with its constants, and trained
policies are graphs, which the page runs as they are.
"""

import base64
import html
from collections.abc import Mapping, Sequence
from importlib import metadata
from typing import Any

import mujoco
import numpy as np

from arc_suite import models, policies
from arc_suite.animation import pages, player_controls
from arc_suite.bodies import universal
from arc_suite.bodies.universal import Universal
from arc_suite.cpg import Demonstrator, leaps
from arc_suite.cpg.presets import DEFAULTS
from arc_suite.cpg.selection import presets_of
from arc_suite.cpg.stepping import Directed
from arc_suite.envs.setup import Setup
from arc_suite.models import posture
from arc_suite.models.kinematics import Legs
from arc_suite.models.standing import GRAVITY
from arc_suite.policies import other_libraries
from arc_suite.policies.network import Network
from arc_suite.robots.spec import Body
from arc_suite.tasks import Task, clock

GROUNDS = {"level": "flat", "bumps": "bumps"}  # arenas by the names that a page shows

_DIRECTED, _TASK = "directed", "steer"  # whose command the player gives, to demonstrators and to others
_BLOCKS = ("posture", "velocities", "contact_forces", "gait_clock", "command")  # that a page can observe


def page(creatures: Sequence[Mapping[str, Any]]) -> str:
    """Return a page to play in, given what `creature` returns for each body to choose from.

    Raises:
        ValueError: the scripts have not been built.
    """
    return pages.template("play.html").substitute(
        title=html.escape(", ".join(creature["name"] for creature in creatures)),
        licenses=licenses(),
        data=pages.pack(creatures),
        engine=base64.b64encode(pages.read_built_file("mujoco.wasm.zlib")).decode(),
        script=pages.read_built_file("play.js").decode(),
    )


def licenses() -> str:
    """Return the license of MuJoCo and its notices of third parties, from its wheel, as text of an HTML comment."""
    files = sorted(file for file in metadata.files("mujoco") or () if file.parent.name == "licenses")
    texts = [file.read_text(encoding="utf-8") for file in files]
    return "\n\n".join(["This page contains MuJoCo and scripts of arc_suite.", *texts]).replace("-->", "-- >")


def creature(body: Body, policy: str = "cpg", preset: str | None = None) -> dict[str, Any]:
    """Return a body with its grounds and policy, as a page takes them: values that JSON has.

    Args:
        body: any.
        policy: cpg, for a demonstrator that follows the command; or the name of a trained policy, as for
            `policies.policy`.
        preset: of the demonstrator: steered, which None stands for, surefooted or reactive.

    Raises:
        ValueError: a policy or preset that a page cannot run, or that does not fit the body.
        OSError: a policy's file cannot be read.
    """
    setup = Setup.of(body, _DIRECTED if policy == "cpg" else _TASK)
    commanded = setup.definition
    if policy == "cpg":
        task, driver = commanded, _law(commanded, preset or "steered")
    else:
        task, driver = _graph(body, policy, commanded)
    return pages.body_drawing(body) | {
        "name": body.name,
        "timestep": commanded.scene.control_timestep / commanded.scene.substeps,
        "substeps": commanded.scene.substeps,
        "feet": [
            {"part": body.part_names.index(leg.full_name(leg.foot)), "radius": leg.foot.radius} for leg in body.legs
        ],
        "grounds": {name: _ground(setup, arena) for name, arena in GROUNDS.items()},
        "task": pages.to_json_values(_task(task, commanded), digits=None),
        "policy": pages.to_json_values(driver, digits=None),
    }


def _ground(setup: Setup, arena: str) -> dict[str, Any]:
    """The MJCF of a body in an arena, with the integrator of simulations, and where the body starts."""
    task, model = Setup.of(setup.body, setup.task, {"arena": arena}).prepare()
    text = models.text(setup.body, task.scene.arena)
    if model.opt.integrator == mujoco.mjtIntegrator.mjINT_EULER:
        text = text.replace('integrator="implicitfast"', 'integrator="Euler"')
    data = mujoco.MjData(model)
    data.qpos[:] = task.scene.standing
    mujoco.mj_forward(model, data)
    return {"xml": text, "start": pages.to_json_values(task.raise_off_ground(task.read(data)), digits=None)}


def _task(task: Task, commanded: Task) -> dict[str, Any]:
    """What a page computes of a task: its frame, clock, units and health; see web/task.js.

    Args:
        task: of the policy.
        commanded: of the same body, whose units and health hold where the task has none.
    """
    headed = "command" in task.commands
    context, health = (task if headed else commanded).context, commanded.health  # type: ignore[attr-defined]  # of commands
    scene, (force_unit,) = commanded.scene, context.force_unit
    layout, angles = scene.layout, np.r_[scene.layout.joint_angles]
    return {
        "headed": headed,
        "parts": np.r_[layout.parts],
        "joints": angles,
        "dofs": np.r_[layout.joint_velocities],
        "home": scene.standing[angles],
        "step": scene.control_timestep,
        "turn": clock.TWO_PI * task.parameters.gait_frequency * scene.control_timestep,
        "units": context.units,
        "leak": context.leak,
        "force_unit": force_unit if headed else np.ones(6),
        "weight": force_unit[5],
        "lowest": health.lowest * context.height,
        "lying": health.lying,
        "least_upright": health.least_upright,
        "direction": _direction(task) if player_controls.is_directed(task) else None,
    }


def _direction(task: Task) -> dict[str, Any]:
    """What a page computes of pose and gait, and what the player chooses from; see web/direction.js and panel.js."""
    body, reference = task.scene.body, task.context.reference  # type: ignore[attr-defined]  # of commands
    return {
        "glide": reference.glide,
        "step": reference.step,
        "rate": (body.torso.standing_height / GRAVITY) ** 0.5 / reference.step,
        "names": posture.POSE_NAMES,
        "room": player_controls.pose_room(body),
        "frequency": task.parameters.gait_frequency,
        "gaits": player_controls.gaits_by_name(task),
    }


def _law(task: Task, preset: str) -> dict[str, Any]:
    law = Demonstrator(task, preset).law
    if not isinstance(law, Directed):
        raise ValueError(
            f"preset {preset!r}: a page runs steered, surefooted or reactive, which follow a command by joint angles"
        )
    return {"kind": "law", "constants": law.constants() | {"leaps": _leaps(law)}}


def _leaps(law: Directed) -> dict[str, Any]:
    """Targets of joints (steps, joints), rad, and the step at which the crouch ends, of the leaps that a body can."""
    body, legs, rest = law.body, Legs.of(law.body), law.rest_angles  # whose joints use all of their ranges in a leap
    pose, made = tuple(legs.by_joint(rest).tolist()), {}
    ahead = presets_of(body)["leaping"].choice + DEFAULTS["leaping"].choice
    for name, choice, measure in (("jump", leaps.JUMPS, "clearance"), ("leap", ahead, "distance")):
        try:
            leap = leaps.choose_leap(body, pose, choice, measure)
        except ValueError:
            continue  # and the page has no key for it
        crouched = leaps.plan_movement(body, legs, rest, leap).crouch_end
        made[name] = {"crouched": crouched, "targets": leaps.leap_targets(body, legs, rest, leap)}
    return made


def _graph(body: Body, name: str, steer: Task) -> tuple[Task, dict[str, Any]]:
    made = policies.policy(name, body, task=steer if name == universal.NAME else None)
    if other_libraries.find(name):
        made = policies.trained(name)
    if isinstance(made, Universal):  # acts in the task that it was trained in
        made = universal.for_body(made.network, Setup.of(body, made.network.setup.task))
    if not isinstance(made, Network):
        raise ValueError(f"policy {name}: a page runs cpg, ppo, universal, or one trained network")
    blocks, task = made.blocks, made.setup.definition
    if unknown := [block for block in blocks if block not in _BLOCKS]:
        raise ValueError(f"policy {name}: observes {unknown[0]}, and a page has {', '.join(_BLOCKS)} alone")
    if task.actions != steer.actions:
        raise ValueError(f"policy {name}: its actions are a {task.actions} a joint, and a page takes {steer.actions}s")
    nodes = [[node.operator, *node.inputs] for node in made.graph.nodes]
    arrays = {array: _array(values) for array, values in made.graph.arrays.items()}
    return task, {"kind": "graph", "constants": {"blocks": list(blocks), "nodes": nodes, "arrays": arrays}}


def _array(values: np.ndarray) -> dict[str, Any]:
    data = base64.b64encode(values.astype(values.dtype.newbyteorder("<")).tobytes()).decode()
    return {"type": values.dtype.name, "shape": values.shape, "data": data}
