"""Motions simulated from the pose at rest: a rise, jumps, a death."""

import copy
import math

import mujoco
import numpy as np

from arc_suite import policies, rotations
from arc_suite.animation.clips import gestures
from arc_suite.animation.clips.recordings import Recording, record
from arc_suite.animation.clips.root_motion import ClipMotion, Pose, advance_straight, put_on_root, stay_at_start
from arc_suite.cpg import leaps
from arc_suite.cpg.drives import drive
from arc_suite.cpg.selection import presets_of
from arc_suite.envs.setup import Setup
from arc_suite.models import sizing
from arc_suite.models.kinematics import Legs
from arc_suite.models.outline import torso_box
from arc_suite.models.standing import pose_mechanics, standing_qpos
from arc_suite.motions.ground_poses import ground_poses, relative_pose
from arc_suite.robots.spec import Body
from arc_suite.simulation.model import compile_model
from arc_suite.tasks import readings
from arc_suite.tasks.modifiers.drags import have_drags

# Durations are multiples of sqrt(h / g), h being the standing height.
_SINK_DURATION = 6.0
_HOLD_DURATION = 2.0
_COLLAPSE_DURATION = 1.5  # in which legs give way in a death
_LIMP_DURATION = 6.0

_RECOVERY_TASK = "recover"
_FALL_SECONDS = 4.0  # of getting up, and of standing after it
_FALLS = 20  # that are tried, of the judges' table
_ON_BACK = -0.7  # cosine of the tilt of a torso that lies on its back

_LIMP_DAMPING_SHARE = 0.05  # of the damping of joints, in joints without life
_LYING_HEIGHT = 0.6  # of the torso's height at rest: a lower torso lies
_LYING_CLEARANCE = 0.1  # of the torso's height at rest: a torso whose lowest point is nearer to the ground lies


def rise(body: Body, rest: Pose) -> ClipMotion:
    """Return how a body rises from its belly, or as near to it as its legs fold.

    Raises:
        ValueError: the legs hardly fold.
    """
    sink_steps = _to_steps(body, _SINK_DURATION)
    hold_steps = _to_steps(body, _HOLD_DURATION)
    sinking = _ease_in(sink_steps)
    depth_shares = np.concatenate([sinking, np.ones(hold_steps), sinking[::-1], np.zeros(hold_steps)])
    joints = gestures.lower_torso(body, rest, depth_shares * _belly_height(body, rest))
    recording = _simulate(body, rest, _bear_weight(body, rest, joints))
    first = sizing.simulation(body).substeps * (sink_steps + hold_steps)
    _check_lies(body, rest, recording.poses[first])
    last = len(recording.poses) - 1
    return stay_at_start(recording, first, samples=last - first)


def get_up(body: Body, rest: Pose) -> ClipMotion:
    """Return how a body gets up from its back, by the policy of the package for the task recover.

    The root stays where the torso is in the end.

    Raises:
        ValueError: the package has no such policy, or the body does not get up.
    """
    if not policies.is_packaged(body, _RECOVERY_TASK):
        raise ValueError(f"the package has no policy of {_RECOVERY_TASK} for it")
    setup = Setup.of(body, _RECOVERY_TASK)
    policy = policies.policy("ppo", body, task=setup.definition)
    for seed in range(_FALLS):
        environment = setup.load(seed)
        recording = record(environment, policy, settle=0, steps=round(_FALL_SECONDS / environment.control_timestep()))
        has_got_up = environment.task.progress["up"]
        environment.close()
        if has_got_up and rotations.upright(recording.poses[0, 3:7]) < _ON_BACK:
            torso = ground_poses(recording.poses)
            root = np.zeros((len(torso), 3))
            return put_on_root(recording.time_step, recording.poses, root, relative_pose(torso[-1], torso))
    raise ValueError(f"it does not get up from its back within {_FALL_SECONDS:g} s")


def jump(body: Body, rest: Pose) -> ClipMotion:
    """Return how a body jumps on the spot.

    Raises:
        ValueError: its feet do not leave the ground, or it does not land on them.
    """
    recording = _simulate_leap(body, rest, leaps.JUMPS, "clearance")  # the largest height of the lowest foot
    return stay_at_start(recording, first=0, samples=len(recording.poses) - 1)


def leap(body: Body, rest: Pose) -> ClipMotion:
    """Return how a body leaps ahead, over a root that goes along below its torso.

    Raises:
        ValueError: its feet do not leave the ground, or it does not land on them.
    """
    candidates = presets_of(body)["leaping"].choice  # leaps, of which bodies take the one that suits them
    return advance_straight(_simulate_leap(body, rest, candidates, "distance"))


def death(body: Body, rest: Pose) -> ClipMotion:
    """Return how a body collapses: its legs give way, then its joints are without torque and nearly without damping.

    Raises:
        ValueError: the legs hardly fold.
    """
    collapse_steps = _to_steps(body, _COLLAPSE_DURATION)
    limp_steps = _to_steps(body, _LIMP_DURATION)
    depth_shares = np.append(_ease_in(collapse_steps), 1.0)  # 1 is reached after the last step
    joints = gestures.lower_torso(body, rest, depth_shares * _belly_height(body, rest))
    no_torque = np.full((limp_steps, len(rest.joints)), np.nan)
    recording = _simulate(body, rest, np.concatenate([joints, no_torque]), damping_share=_LIMP_DAMPING_SHARE)
    _check_lies(body, rest, recording.poses[-1])
    return stay_at_start(recording, first=0, samples=len(recording.poses) - 1)


def _simulate_leap(body: Body, rest: Pose, candidates: tuple[leaps.Leap, ...], measure: str) -> Recording:
    """Return the best of some leaps by a measure of `leaps`, from rest to rest."""
    legs = Legs.of(sizing.size_body(body))
    best_leap = leaps.choose_leap(body, tuple(rest.joints.tolist()), candidates, measure)
    leap_joints = leaps.leap_targets(body, legs, legs.by_leg(rest.joints), best_leap)
    rest_joints = np.tile(rest.joints, (_to_steps(body, _HOLD_DURATION), 1))
    joints = np.concatenate([leap_joints, rest_joints])
    return _simulate(body, rest, _bear_weight(body, rest, joints))


def _belly_height(body: Body, rest: Pose) -> float:
    """Return the height of the torso's lowest point over the ground at rest, m."""
    lowest_corner, _ = torso_box(body)  # in the torso's frame, m
    return rest.position[2] + lowest_corner[2]


def _check_lies(body: Body, rest: Pose, pose: np.ndarray) -> None:
    """Raise a ValueError unless the torso lies on the ground in a pose (7 + joints,)."""
    rest_height = rest.position[2]
    height = pose[2]
    is_high = height > _LYING_HEIGHT * rest_height
    lowest_height = _belly_height(body, rest) + (height - rest_height)  # of the torso's lowest point, if it is level
    is_clear = lowest_height > _LYING_CLEARANCE * rest_height
    if is_high and is_clear:
        raise ValueError("the legs do not fold far enough to lie down")


def _to_steps(body: Body, duration: float) -> int:
    """Return the number of control steps in a multiple of sqrt(h / g)."""
    seconds = duration * math.sqrt(body.torso.standing_height / sizing.GRAVITY)
    return round(seconds / sizing.control_timestep(body))


def _ease_in(steps: int) -> np.ndarray:
    """Return shares (steps,) that rise smoothly from 0; a further step would reach 1."""
    return 0.5 - 0.5 * np.cos(np.pi * np.arange(steps) / steps)


def _bear_weight(body: Body, rest: Pose, joints: np.ndarray) -> np.ndarray:
    """Return targets (steps, joints), rad, for angles (steps, joints), so that control bears the weight at rest."""
    return joints + _loaded_targets(body, rest) - rest.joints


def _loaded_targets(body: Body, rest: Pose) -> np.ndarray:
    """Return the target angles (joints,), rad, at which position control holds a pose under the body's weight."""
    sized_body = sizing.size_body(body)
    standing_pose = pose_mechanics(sized_body, rest.joints)
    torque_limits = np.array([joint.torque for joint in sized_body.joints])  # N m
    stiffness = drive(sized_body, standing_pose.inertias).stiffness  # shares of the torque limits per rad
    return rest.joints + standing_pose.loads / (torque_limits * stiffness)  # loads: N m that hold the pose


def _simulate(body: Body, rest: Pose, targets: np.ndarray, damping_share: float = 1.0) -> Recording:
    """Simulate a body from rest.

    Args:
        body: the spec.
        rest: first pose.
        targets: (steps + 1, joints) targets of position control at the start and after each step, rad. A step that
            begins or ends with NaN has no torque.
        damping_share: damping of the joints, as a share of their own.

    Returns:
        A pose for every substep.
    """
    sized_body = sizing.size_body(body)
    joint_drive = drive(sized_body, pose_mechanics(sized_body, rest.joints).inertias)
    control_timestep = sizing.control_timestep(body)
    substeps = sized_body.simulation.substeps
    joint_count = len(body.joint_names)
    is_imported = bool(body.source)
    controls = 3 if have_drags(body) else 2  # of a servo; see `models.source`
    model = copy.copy(compile_model(body))
    model.dof_damping[6:] *= damping_share  # the first six are the torso's
    layout = readings.layout(model, body)
    data = mujoco.MjData(model)
    rest_pose = np.concatenate(rest)  # position, quaternion and joint angles
    data.qpos[:] = readings.positions(rest_pose, layout, standing_qpos(model))
    positions = [data.qpos.copy()]
    for target, next_target in zip(targets[:-1], targets[1:], strict=True):
        angles = readings.pose(data.qpos, layout)[7:]
        speeds = data.qvel[layout.joint_velocities]
        target_speeds = (next_target - target) / control_timestep
        actions = joint_drive.actions(target, target_speeds, angles, speeds)
        data.ctrl[:joint_count] = np.nan_to_num(actions)
        if is_imported:  # its joints have servos, and further controls for each, which release the servo
            data.ctrl[joint_count : controls * joint_count] = np.tile(np.isnan(actions), controls - 1)
        for _ in range(substeps):
            mujoco.mj_step(model, data)
            positions.append(data.qpos.copy())
    return Recording(model.opt.timestep, substeps, readings.pose(np.stack(positions), layout))
