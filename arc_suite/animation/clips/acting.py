"""Motions simulated from the pose at rest: a rise, jumps, a death."""

import itertools
import math

import mujoco
import numpy as np

from arc_suite import policies, rotations
from arc_suite.animation.clips import hard_ground, standing_legs
from arc_suite.animation.clips.recordings import Recording, record
from arc_suite.animation.clips.root_motion import ClipMotion, Pose, advance_straight, stay_at_end, stay_at_start
from arc_suite.cpg import leaps
from arc_suite.cpg.drives import drive
from arc_suite.cpg.selection import presets_of
from arc_suite.envs.setup import Setup
from arc_suite.models import sizing
from arc_suite.models.kinematics import Legs
from arc_suite.models.outline import torso_box
from arc_suite.models.standing import pose_mechanics, standing_qpos
from arc_suite.robots.spec import Body
from arc_suite.tasks import readings
from arc_suite.tasks.modifiers.drags import have_drags

# Durations are multiples of sqrt(h / g), h being the standing height.
_SINK_DURATION = 6.0
_HOLD_DURATION = 2.0
_COLLAPSE_DURATION = 1.5  # in which legs give way in a death
_LIMP_DURATION = 6.0
_STIFFENING_DURATION = 24.0  # after which joints without life have come to rest

_MAX_JUMP_TRIES = 6  # jumps that are simulated from rest, of those that a trial finds

_MAX_ASIDE = 0.3  # of the distance ahead, by which a leap goes aside

_RECOVERY_TASK = "recover"
_FALL_SECONDS = 4.0  # of getting up, and of standing after it
_FALLS = 20  # that are tried, of the judges' table
_ON_BACK = -0.7  # cosine of the tilt of a torso that lies on its back

_LIMP_DAMPING_SHARE = 0.05  # of the damping of joints, in joints without life
_STIFF_FRICTION = 1.0  # of the torques of motors: dry friction of joints that have become stiff
_REST_SPEED = np.radians(1.0)  # rad/s: slower joints are at rest
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
    joints = standing_legs.lower_torso(body, rest, depth_shares * _belly_height(body, rest))
    recording = _simulate(body, rest, _bear_weight(body, rest, joints))
    first = sizing.simulation(body).substeps * (sink_steps + hold_steps)
    _check_lies(body, rest, recording.poses[first])
    return stay_at_end(recording, first)


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
            return stay_at_end(recording, first=0)
    raise ValueError(f"it does not get up from its back within {_FALL_SECONDS:g} s")


def jump(body: Body, rest: Pose) -> ClipMotion:
    """Return how a body jumps on the spot.

    Raises:
        ValueError: its feet do not leave the ground, or it does not land on them where it stood.
    """
    rest_joints = tuple(rest.joints.tolist())
    leaps.choose_jump(body, rest_joints)
    drifts = []
    for chosen_jump in itertools.islice(leaps.jumps_that_stay(body, rest_joints), _MAX_JUMP_TRIES):
        recording = _simulate_leap(body, rest, chosen_jump)
        drifts.append(float(np.linalg.norm(_measure_drift(body, recording))))
        if drifts[-1] <= leaps.MAX_DRIFT:
            return stay_at_start(recording, first=0, samples=len(recording.poses) - 1)
    raise ValueError(leaps.describe_drift(min(drifts)))


def leap(body: Body, rest: Pose) -> ClipMotion:
    """Return how a body leaps ahead, over a root that goes along below its torso.

    Raises:
        ValueError: its feet do not leave the ground, or it does not land on them straight ahead.
    """
    candidates = presets_of(body)["leaping"].choice  # leaps, of which bodies take the one that suits them
    best_leap = leaps.choose_leap(body, tuple(rest.joints.tolist()), candidates)
    recording = _simulate_leap(body, rest, best_leap)
    ahead, aside = _measure_drift(body, recording)
    if abs(aside) > _MAX_ASIDE * ahead:
        raise ValueError(f"its feet come down {ahead:.2f} standing heights ahead and {abs(aside):.2f} aside")
    return advance_straight(recording)


def death(body: Body, rest: Pose) -> ClipMotion:
    """Return how a body collapses: its legs give way, its joints are limp, then become stiff, until it is at rest.

    Limp joints have no torque, and hardly any damping.

    Raises:
        ValueError: the legs hardly fold.
    """
    collapse_steps = _to_steps(body, _COLLAPSE_DURATION)
    limp_steps = _to_steps(body, _LIMP_DURATION)
    depth_shares = np.append(_ease_in(collapse_steps), 1.0)  # 1 is reached after the last step
    joints = standing_legs.lower_torso(body, rest, depth_shares * _belly_height(body, rest))
    stiffening_steps = _to_steps(body, _STIFFENING_DURATION)
    no_torque = np.full((limp_steps + stiffening_steps, len(rest.joints)), np.nan)
    stiffness = np.zeros(len(joints) + len(no_torque))
    stiffness[-stiffening_steps:] = np.linspace(0.0, 1.0, stiffening_steps) ** 2
    recording = _simulate(body, rest, np.concatenate([joints, no_torque]), stiffness)
    samples = _samples_to_rest(recording)
    _check_lies(body, rest, recording.poses[samples])
    return stay_at_start(recording, first=0, samples=samples)


def _simulate_leap(body: Body, rest: Pose, chosen_leap: leaps.Leap) -> Recording:
    """Return a leap from rest to rest."""
    legs = Legs.of(sizing.size_body(body))
    leap_joints = leaps.leap_targets(body, legs, legs.by_leg(rest.joints), chosen_leap)
    rest_joints = np.tile(rest.joints, (_to_steps(body, _HOLD_DURATION), 1))
    joints = np.concatenate([leap_joints, rest_joints])
    return _simulate(body, rest, _bear_weight(body, rest, joints))


def _measure_drift(body: Body, recording: Recording) -> np.ndarray:
    """Return the distance (2,) along x and y between the mean positions of feet at both ends, standing heights."""
    ends = recording.poses[[0, -1]]
    legs = Legs.of(body)
    soles, _ = legs.soles(legs.by_leg(ends[:, 7:]))  # in the torso's frame
    feet = soles @ rotations.matrix(ends[:, 3:7]).swapaxes(-1, -2) + ends[:, None, :3]
    return (feet[1] - feet[0])[:, :2].mean(axis=0) / body.torso.standing_height


def _samples_to_rest(recording: Recording) -> int:
    """Return the samples after which no joint moves any more; all of them if some still do."""
    speeds = abs(np.diff(recording.poses[:, 7:], axis=0)).max(axis=-1) / recording.time_step
    moving = np.flatnonzero(speeds > _REST_SPEED)
    return min(int(moving[-1]) + 2, len(speeds)) if len(moving) else len(speeds)


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


def _simulate(body: Body, rest: Pose, targets: np.ndarray, stiffness: np.ndarray | None = None) -> Recording:
    """Simulate a body from rest on hard ground.

    Args:
        body: the spec.
        rest: first pose.
        targets: (steps + 1, joints) targets of position control at the start and after each step, rad. A step that
            begins or ends with NaN has no torque.
        stiffness: (steps + 1,) of joints without life, from 0 to 1; None for joints with their own damping.

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
    model = hard_ground.compile_on_hard_ground(body)
    layout = readings.layout(model, body)
    if stiffness is None:
        frictions = np.tile(model.dof_frictionloss, (len(targets), 1))
    else:
        model.dof_damping[6:] *= _LIMP_DAMPING_SHARE  # the first six are the torso's
        torques = np.zeros(model.nv)  # N m
        torques[layout.joint_velocities] = [joint.torque for joint in sized_body.joints]
        frictions = _STIFF_FRICTION * stiffness[:, None] * torques
    data = mujoco.MjData(model)
    rest_pose = np.concatenate(rest)  # position, quaternion and joint angles
    data.qpos[:] = readings.positions(rest_pose, layout, standing_qpos(model))
    positions = [data.qpos.copy()]
    for target, next_target, friction in zip(targets[:-1], targets[1:], frictions[:-1], strict=True):
        model.dof_frictionloss[:] = friction
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
