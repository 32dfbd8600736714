"""Recordings of policies at the pace of the physics: every substep, bit-exact."""

from collections.abc import Iterable
from typing import NamedTuple

import mujoco
import numpy as np
from mujoco import rollout

from arc_suite.animation.clips.blows import Blow
from arc_suite.envs.dm import Environment
from arc_suite.policies import Policy, alone
from arc_suite.simulation.episode_loop import play_episode
from arc_suite.tasks.readings import pose

_FULL_STATE = mujoco.mjtState.mjSTATE_FULLPHYSICS
_REST_SPEED = np.radians(1.0)  # rad/s: slower joints are at rest


class Recording(NamedTuple):
    """Poses of one body, one for every substep.

    Attributes:
        time_step: s between two poses.
        substeps: substeps of a control step.
        poses: (samples, 7 + joints): torso position and quaternion in the world, joint angles from the standing pose,
            rad.
    """

    time_step: float
    substeps: int
    poses: np.ndarray


def record(
    environment: Environment,
    policy: Policy,
    settle: int,
    steps: int,
    commands: Iterable[tuple[int, tuple]] = (),
    blow: Blow | None = None,
    **fixed_commands,
) -> Recording:
    """Play a policy and record it, once it has settled.

    Control steps are taken in the environment. Their substeps are then run again from the state in which the recording
    begins, with the same controls, which is bit-exact.

    Args:
        environment: environment of `arc_suite.load`; its next episode is played.
        policy: made for one environment.
        settle: control steps before the recording.
        steps: control steps to record.
        commands: pairs of a control step, counted from the start, and the value that the task's `command` takes there.
        blow: comes where the recording begins, which has its samples, too.
        fixed_commands: values of the task's other commands by name, from the start on.

    Returns:
        A pose for every substep, and the first one.

    Raises:
        ValueError: the episode ends before.
    """
    command_at_step = dict(commands)
    model = environment.physics.model.ptr
    data = environment.physics.data.ptr
    control_of_step = []
    if blow is not None:
        blow.set_ground(model)
    for step, timestep in enumerate(play_episode(environment, alone(policy), max_steps=settle + steps)):
        if timestep.last():
            raise ValueError(f"the episode ends after {step} control steps, {settle + steps} are needed")
        if timestep.first():
            for name, value in fixed_commands.items():
                environment.command(name, value)
        else:
            control_of_step.append(data.ctrl.copy())
        if step in command_at_step:
            environment.command("command", command_at_step[step])
        if step == settle:
            first_qpos = data.qpos[None].copy()
            if blow is not None:
                struck_qpos = blow.strike(environment.task.definition.scene.body, model, data)
                first_qpos = np.concatenate([struck_qpos, data.qpos[None]])
            first_state = np.empty(mujoco.mj_stateSize(model, _FULL_STATE))
            mujoco.mj_getState(model, data, first_state, _FULL_STATE)
            warmstart = data.qacc_warmstart.copy()
    scene = environment.task.definition.scene
    controls = np.repeat(control_of_step[settle:], scene.substeps, axis=0)
    states, _ = rollout.rollout(model, mujoco.MjData(model), first_state, controls[None], initial_warmstart=warmstart)
    later_qpos = states[0, :, 1 : 1 + model.nq]  # in a full state, time comes first and then the positions
    qpos = np.concatenate([first_qpos, later_qpos])
    return Recording(model.opt.timestep, scene.substeps, pose(qpos, scene.layout))


def samples_to_rest(recording: Recording) -> int:
    """Return the samples after which neither joints nor the torso turn any more; all of them if some still do."""
    speeds = abs(np.diff(recording.poses[:, 3:], axis=0)).max(axis=-1) / recording.time_step
    moving = np.flatnonzero(speeds > _REST_SPEED)
    return min(int(moving[-1]) + 2, len(speeds)) if len(moving) else len(speeds)
