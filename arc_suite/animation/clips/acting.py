"""Motions that are simulated: rises, jumps, deaths."""

import itertools

import mujoco
import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips import hard_ground, standing_legs
from arc_suite.animation.clips.blows import Blow
from arc_suite.animation.clips.recordings import Recording, stop_at_rest, turns
from arc_suite.animation.clips.root_motion import ClipMotion, Pose, advance_straight, stay_at_end, stay_at_start
from arc_suite.cpg import leaps
from arc_suite.cpg.drives import drive
from arc_suite.cpg.selection import presets_of
from arc_suite.models import sizing, standing
from arc_suite.models.kinematics import Legs
from arc_suite.models.outline import torso_box
from arc_suite.models.standing import pose_mechanics, standing_qpos
from arc_suite.robots.spec import Body
from arc_suite.tasks import readings

# Durations are multiples of sqrt(h / g), h being the standing height.
_SINK_DURATION = 6.0
_HOLD_DURATION = 2.0

_MAX_JUMP_TRIES = 6  # jumps that are simulated from rest, of those that a trial finds

_MAX_ASIDE = 0.3  # of the distance ahead, by which a leap goes aside

# A death, by a blow after which motors are limp. Joints then turn freely, and become stiff. The numbers of a joint
# are those of a body of unit weight and height, by the number of its legs.
_DEADLY_BLOW = 0.8  # sqrt(g h)
_DEADLY_LEVER = 0.25  # standing heights
_FOOT_FRICTION = 0.4  # of feet that slip away
_LIMP_ARMATURE = 0.002
_LIMP_DAMPING = 0.02
_STIFF_FRICTION = 1.0  # dry friction
_LIMP_DURATION = 6.0
_STIFFENING_DURATION = 14.0  # after which joints without life have come to rest
_LYING_HEIGHT = 0.65  # of the torso's height at rest: a lower torso lies
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
    joints = standing_legs.lower_torso(body, rest, depth_shares * standing_legs.measure_belly_height(body, rest))
    recording = _simulate(body, rest, _bear_weight(body, rest, joints))
    first = sizing.simulation(body).substeps * (sink_steps + hold_steps)
    _check_lies(body, rest, recording.poses[first])
    first += int(turns(recording)[first:].argmax())
    return stay_at_end(stop_at_rest(recording), first)


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


def death(body: Body, rest: Pose, side: str) -> ClipMotion:
    """Return how a body falls under a blow after which its motors are limp, until it is at rest.

    Args:
        body: the spec.
        rest: pose from which it falls.
        side: side from which the blow comes; see `blows.Blow`.

    Raises:
        ValueError: the torso does not come to lie on the ground.
    """
    recording = _simulate_limp(body, rest, side)
    recording = stop_at_rest(recording)
    _check_lies(body, rest, recording.poses[-1])
    return stay_at_start(recording, first=0, samples=len(recording.poses) - 1)


def _simulate_leap(body: Body, rest: Pose, chosen_leap: leaps.Leap) -> Recording:
    """Return a leap from rest to rest."""
    legs = Legs.of(sizing.size_body(body))
    leap_joints = leaps.leap_targets(body, legs, legs.by_leg(rest.joints), chosen_leap)
    rest_joints = np.tile(rest.joints, (_to_steps(body, _HOLD_DURATION), 1))
    joints = np.concatenate([leap_joints, rest_joints])
    return stop_at_rest(_simulate(body, rest, _bear_weight(body, rest, joints)))


def _measure_drift(body: Body, recording: Recording) -> np.ndarray:
    """Return the distance (2,) along x and y between the mean positions of feet at both ends, standing heights."""
    ends = recording.poses[[0, -1]]
    legs = Legs.of(body)
    soles = legs.sole_positions(legs.by_leg(ends[:, 7:]))  # in the torso's frame
    feet = soles @ rotations.matrix(ends[:, 3:7]).swapaxes(-1, -2) + ends[:, None, :3]
    return (feet[1] - feet[0])[:, :2].mean(axis=0) / body.torso.standing_height


def _check_lies(body: Body, rest: Pose, pose: np.ndarray) -> None:
    """Raise a ValueError unless the torso lies on the ground in a pose (7 + joints,)."""
    rest_height = rest.position[2]
    height = pose[2]
    is_high = height > _LYING_HEIGHT * rest_height
    corners = np.array(list(itertools.product(*zip(*torso_box(body), strict=True))))  # in the torso's frame, m
    lowest_height = height + (rotations.matrix(pose[3:7])[2] @ corners.T).min()
    is_clear = lowest_height > _LYING_CLEARANCE * rest_height
    if is_high and is_clear:
        raise ValueError("the legs do not fold far enough to lie down")


def _to_steps(body: Body, duration: float) -> int:
    """Return the number of control steps in a multiple of sqrt(h / g)."""
    seconds = duration * standing.time_unit(body)
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


def _simulate(body: Body, rest: Pose, targets: np.ndarray) -> Recording:
    """Simulate a body from rest on hard ground, under position control.

    Args:
        body: the spec.
        rest: first pose.
        targets: (steps + 1, joints) targets at the start and after each step, rad.

    Returns:
        A pose for every substep.
    """
    sized_body = sizing.size_body(body)
    joint_drive = drive(sized_body, pose_mechanics(sized_body, rest.joints).inertias)
    control_timestep = sizing.control_timestep(body)
    substeps = sized_body.simulation.substeps
    joint_count = len(body.joint_names)
    model = hard_ground.compile_on_hard_ground(body)
    layout = readings.layout(model, body)
    data = _start_at(model, layout, rest)
    positions = [data.qpos.copy()]
    for target, next_target in itertools.pairwise(targets):
        angles = readings.pose(data.qpos, layout)[7:]
        speeds = data.qvel[layout.joint_velocities]
        target_speeds = (next_target - target) / control_timestep
        data.ctrl[:joint_count] = joint_drive.actions(target, target_speeds, angles, speeds)
        for _ in range(substeps):
            mujoco.mj_step(model, data)
            positions.append(data.qpos.copy())
    return Recording(model.opt.timestep, substeps, readings.pose(np.stack(positions), layout))


def _simulate_limp(body: Body, rest: Pose, side: str) -> Recording:
    """Simulate a body from rest on hard ground, under a blow from a side, with limp joints that become stiff.

    Returns:
        A pose for every substep.
    """
    model = hard_ground.compile_on_hard_ground(body)
    layout = readings.layout(model, body)
    height = body.torso.standing_height
    leg_mass = model.body_mass.sum() / len(body.legs)  # kg, that a leg carries
    leg_load = leg_mass * standing.GRAVITY * height  # N m
    time_unit = standing.time_unit(body)  # s
    joints = layout.joint_velocities
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    model.dof_armature[joints] = model.dof_armature[joints].clip(max=_LIMP_ARMATURE * leg_mass * height**2)
    model.dof_damping[joints] = model.dof_damping[joints].clip(max=_LIMP_DAMPING * leg_load * time_unit)
    data = _start_at(model, layout, rest)
    mujoco.mj_forward(model, data)
    blow = Blow(side, _DEADLY_BLOW, _DEADLY_LEVER, _FOOT_FRICTION)
    blow.set_ground(model)
    positions = list(blow.strike(body, model, data))
    limp_substeps = round(_LIMP_DURATION * time_unit / model.opt.timestep)
    stiffening_substeps = round(_STIFFENING_DURATION * time_unit / model.opt.timestep)
    stiffness = np.append(np.zeros(limp_substeps), np.linspace(0.0, 1.0, stiffening_substeps) ** 2)
    positions.append(data.qpos.copy())
    for share in stiffness:
        model.dof_frictionloss[joints] = share * _STIFF_FRICTION * leg_load
        mujoco.mj_step(model, data)
        positions.append(data.qpos.copy())
    substeps = sizing.simulation(body).substeps
    return Recording(model.opt.timestep, substeps, readings.pose(np.stack(positions), layout))


def _start_at(model: mujoco.MjModel, layout, rest: Pose) -> mujoco.MjData:
    """Return the state of a body in the pose at rest."""
    data = mujoco.MjData(model)
    rest_pose = np.concatenate(rest)  # position, quaternion and joint angles
    data.qpos[:] = readings.positions(rest_pose, layout, standing_qpos(model))
    return data
