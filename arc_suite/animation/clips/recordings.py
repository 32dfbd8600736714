"""Recordings of policies at the pace of the physics: every substep, bit-exact."""

import math
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
_REST_SPEED = np.radians(5.0)  # rad/s: slower joints are at rest; what is left fades for seconds
_REST_ANGLE = np.radians(0.5)  # rad: a body whose joints are nearer to their last angles is at rest though they tremble
_STOP_SECONDS = 0.1  # s of a recording that are slowed at its end
_HOLD_SECONDS = 0.05  # s at rest in the end, so that the last two frames of a clip show a body at rest


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
        ValueError: the episode ends before, or something else than its controls moves the body, such as a kick.
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
    later_qpos = _repeat_substeps(model, first_state, warmstart, controls)
    if not np.array_equal(later_qpos[-1], data.qpos):
        raise ValueError("it is moved by more than its controls, as by kicks, which clips leave out")
    qpos = np.concatenate([first_qpos, later_qpos])
    return Recording(model.opt.timestep, scene.substeps, pose(qpos, scene.layout))


def _repeat_substeps(
    model: mujoco.MjModel, first_state: np.ndarray, warmstart: np.ndarray, controls: np.ndarray
) -> np.ndarray:
    """Return the positions (substeps, nq) after substeps with controls (substeps, motors), from a full state on."""
    states, _ = rollout.rollout(model, mujoco.MjData(model), first_state, controls[None], initial_warmstart=warmstart)
    return states[0, :, 1 : 1 + model.nq]  # in a full state, time comes first and then the positions


def samples_to_rest(recording: Recording) -> int:
    """Return the samples after which neither joints nor the torso turn any more; all of them if some still do."""
    is_far = abs(recording.poses[:-1, 3:] - recording.poses[-1, 3:]).max(axis=-1) > _REST_ANGLE
    return samples_to_calm(turns(recording) & is_far, recording.time_step)


def turns(recording: Recording) -> np.ndarray:
    """Return whether a joint or the torso turns from each sample to the next one, (samples - 1,)."""
    return abs(np.diff(recording.poses[:, 3:], axis=0)).max(axis=-1) > _REST_SPEED * recording.time_step


def samples_to_calm(moves: np.ndarray, time_step: float) -> int:
    """Return the samples after which nothing moves any more; all of them if something moves until the end, or nearly.

    Args:
        moves: (samples - 1,) whether something moves from each sample to the next one.
        time_step: s between two samples.
    """
    moving = np.flatnonzero(moves)
    if not len(moving) or moving[-1] + 2 + _STOP_SECONDS / time_step > len(moves):
        return len(moves)
    return int(moving[-1]) + 2


def stop_at_rest(recording: Recording) -> Recording:
    """Return a recording until nothing turns any more, and a moment of its last pose; all of it if something turns."""
    samples = samples_to_rest(recording)
    if samples == len(recording.poses) - 1:
        return recording
    poses = stop_at(recording, samples).poses
    held_poses = np.tile(poses[-1], (math.ceil(_HOLD_SECONDS / recording.time_step), 1))
    return recording._replace(poses=np.concatenate([poses, held_poses]))


def stop_at(recording: Recording, samples: int) -> Recording:
    """Return the first samples of a recording, the last of which are slowed to a stop.

    The poses are those that were recorded. Their pace falls evenly to 0.

    Args:
        recording: any.
        samples: samples until the last pose.
    """
    slowed = min(samples, round(_STOP_SECONDS / recording.time_step))
    steps = np.arange(1, 2 * slowed + 1)
    last_samples = samples - slowed + steps - steps**2 / max(4.0 * slowed, 1.0)  # fractions of samples
    fractional = np.concatenate([np.arange(samples - slowed + 1), last_samples])
    previous = np.minimum(fractional.astype(int), max(samples - 1, 0))
    share = (fractional - previous)[:, None]
    poses = (1.0 - share) * recording.poses[previous] + share * recording.poses[previous + 1]
    poses[:, 3:7] /= np.linalg.norm(poses[:, 3:7], axis=-1, keepdims=True)
    return recording._replace(poses=poses)
