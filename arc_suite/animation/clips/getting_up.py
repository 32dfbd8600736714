"""How a body gets up from a fall: by a policy of the package or by `rising`, then in steps to the pose at rest."""

import contextlib
import itertools
import math
from collections.abc import Iterator

import numpy as np

from arc_suite import policies, rotations
from arc_suite.animation.clips import on_ground, standing_legs
from arc_suite.animation.clips.recordings import Recording, record, samples_to_calm, stop_at
from arc_suite.animation.clips.root_motion import ClipMotion, Pose, fade_out, put_on_root
from arc_suite.envs.setup import Setup
from arc_suite.motions.ground_poses import ground_poses, relative_pose
from arc_suite.robots.spec import Body

_TASK = "recover"
_SECONDS = 4.0  # of getting up, and of standing after it
_FALLS = 20  # on a side, the back or the belly, that are tried
_SEEDS = 200  # of episodes, among whose first poses they are looked for
# By what a body lies on: the least and the largest cosine of the tilt of its torso.
_TILTS = {"belly": (0.7, 1.0), "side": (-0.4, 0.4), "back": (-1.0, -0.7)}
# A torso that is slower stands.
_MAX_SPEED = 0.02  # standing heights a second
_MAX_TURNING_SPEED = math.radians(5.0)  # rad/s

# Steps to the pose at rest.
_MAX_MISS = 0.01  # standing heights, by which a leg that reaches its place misses it
_MIN_STEP_DURATION = 2.0  # sqrt(h / g), of each step
_STEP_SLOWNESS = 1.5  # sqrt(h / g) that a step lasts longer by each standing height of its length
_STEP_LIFT = 0.12  # standing heights, of a foot in mid-swing
_STEP_LENGTHS = (0.005, 0.05)  # standing heights: feet nearer to their places stay low, those farther off are lifted
_VERTICAL_SHARE = 0.15  # of a swing at either end, in which a foot moves up or down alone


def get_up(body: Body, rest: Pose, lies_on: str) -> ClipMotion:
    """Return how a body gets up from a fall to the pose at rest, by the task recover.

    It acts by the policy of the package, or, without one, by the demonstrator `rising`. The fall is the first in which
    feet that stand hardly slide. The root stays between the feet.

    Args:
        body: the spec.
        rest: pose that it gets up to.
        lies_on: belly, side or back.

    Raises:
        ValueError: the body does not get up, or feet slide in all falls.
    """
    slides = []
    for recording in _record_falls(body, lies_on):
        motion = _stay_between_feet(body, rest, recording)
        motion = motion.append(_step_to_rest(body, rest, motion.pose(-1), motion.time_step))
        slides.append(on_ground.measure_slide(body, on_ground.measure_ground(body, motion)))
        if slides[-1] <= on_ground.MAX_SLIDE * body.torso.standing_height:
            return motion
    if not slides:
        raise ValueError(f"it does not get up from its {lies_on} within {_SECONDS:g} s")
    slide = min(slides) / body.torso.standing_height
    raise ValueError(f"a foot slides by {slide:.2f} standing heights as it gets up from its {lies_on}")


def _record_falls(body: Body, lies_on: str) -> Iterator[Recording]:
    """Yield recordings of falls after which a body stands, until its torso does.

    Legs that hang in the air may creep for seconds after that. They step to their places next.
    """
    setup = Setup.of(body, _TASK)
    if policies.is_packaged(body, _TASK):
        policy = policies.policy("ppo", body, task=setup.definition)
    else:
        policy = policies.policy("cpg", body, "rising", task=setup.definition)
    for seed in itertools.islice(_find_falls(setup, lies_on), _FALLS):
        environment = setup.load(seed)
        recording = record(environment, policy, settle=0, steps=round(_SECONDS / environment.control_timestep()))
        has_got_up = environment.task.progress["up"]
        environment.close()
        samples = _samples_to_stand(body, recording)
        if has_got_up and samples < len(recording.poses) - 1:
            yield stop_at(recording, samples)


def _find_falls(setup: Setup, lies_on: str) -> Iterator[int]:
    """Yield the seeds of episodes in which a body lies on its belly, side or back at the start."""
    least, largest = _TILTS[lies_on]
    with contextlib.closing(setup.load()) as environment:
        for seed in range(_SEEDS):
            environment.reset(seed)
            if least <= rotations.upright(environment.physics.data.qpos[3:7]) <= largest:
                yield seed


def _samples_to_stand(body: Body, recording: Recording) -> int:
    """Return the samples after which the torso of a recording stands still; all of them if it still moves."""
    changes = abs(np.diff(recording.poses[:, :7], axis=0)) / recording.time_step
    moves = changes[:, :3].max(axis=-1) > _MAX_SPEED * body.torso.standing_height
    turns = 2.0 * changes[:, 3:].max(axis=-1) > _MAX_TURNING_SPEED
    return samples_to_calm(moves | turns, recording.time_step)


def _stay_between_feet(body: Body, rest: Pose, recording: Recording) -> ClipMotion:
    """Return a recording whose root stays where, in the end, feet are nearest to their places at rest.

    The turn is that of Kabsch, "A solution for the best rotation to relate two sets of vectors" (1976), in the plane.
    """
    last = recording.poses[-1]
    feet = _place_feet(body, Pose(last[:3], last[3:7], last[7:]))[:, :2]
    rest_feet = _place_feet(body, rest)[:, :2]
    center = feet.mean(axis=0)
    rest_center = rest_feet.mean(axis=0)
    x, y = (rest_feet - rest_center).T
    foot_x, foot_y = (feet - center).T
    yaw = math.atan2(x @ foot_y - y @ foot_x, x @ foot_x + y @ foot_y)
    root = np.array([0.0, 0.0, yaw])
    root[:2] = center - rotations.to_heading_frame(rest_center, -yaw)
    torso = ground_poses(recording.poses)
    still_root = np.zeros((len(torso), 3))
    return put_on_root(recording.time_step, recording.poses, still_root, relative_pose(root, torso))


def _step_to_rest(body: Body, rest: Pose, start: Pose, time_step: float) -> ClipMotion:
    """Return a motion from a standing pose to that at rest: feet step, the torso shifts, the other feet step.

    A leg holds its foot as in the first pose until it steps, and as at rest from then on. Joints go over in the step.

    Args:
        body: the spec.
        rest: last pose.
        start: first pose.
        time_step: s.
    """
    lengths = np.linalg.norm(_place_feet(body, start) - _place_feet(body, rest), axis=-1) / body.torso.standing_height
    torso_offset = standing_legs.poses_of_motion(body, rest, standing_legs.hold_pose(start, 1, time_step))[0]
    steps_early, step_of_leg = _order_steps(body, rest, start, torso_offset)
    steps = int(step_of_leg.max()) + 1
    early_steps = int(step_of_leg[steps_early].max(initial=-1)) + 1
    times = standing_legs.sample_times(body, steps * (_MIN_STEP_DURATION + _STEP_SLOWNESS * lengths.max()))
    progress = steps * times / times[-1]  # number of the step
    swing = (progress[:, None] - step_of_leg).clip(0.0, 1.0)  # progress (samples, legs) of each foot's step
    lifts = np.zeros((*swing.shape, 3))
    lifts[..., 2] = _STEP_LIFT * np.interp(lengths, _STEP_LENGTHS, (0.0, 1.0)) * np.sin(np.pi * swing) ** 2

    poses = fade_out(progress - early_steps + 0.5)[:, None] * torso_offset
    joints_as_at_rest, _ = standing_legs.keep_feet_in_place(body, rest, poses, lifts)
    torso = standing_legs.pose_motion(body, rest, poses, joints_as_at_rest)
    poses_from_start = standing_legs.poses_of_motion(body, start, torso)
    joints_as_at_start, _ = standing_legs.keep_feet_in_place(body, start, poses_from_start, lifts)
    shares = fade_out((swing - _VERTICAL_SHARE) / (1.0 - 2.0 * _VERTICAL_SHARE))
    leg_of_joint = np.repeat(np.arange(len(body.legs)), [len(leg.joints) for leg in body.legs])
    joints = joints_as_at_rest + shares[:, leg_of_joint] * (joints_as_at_start - joints_as_at_rest)
    stepped = torso._replace(joints=joints)
    samples = round(stepped.seconds / time_step)
    return stepped.sample_at(np.linspace(0.0, stepped.seconds, samples + 1))._replace(time_step=time_step)


def _order_steps(body: Body, rest: Pose, start: Pose, torso_offset: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return which legs (legs,) step before the torso shifts, and the number (legs,) of the step of each.

    A leg that cannot hold its foot while the torso shifts steps before it. One that does not reach its place at rest
    from where the torso is steps after it. Neighbors do not step at once.

    Args:
        body: the spec.
        rest: last pose.
        start: first pose.
        torso_offset: (6,) pose of the torso in the first pose, from that at rest.
    """
    max_miss = _MAX_MISS * body.torso.standing_height
    _, misses_from_start = standing_legs.keep_feet_in_place(body, start, -torso_offset[None])
    _, misses_from_rest = standing_legs.keep_feet_in_place(body, rest, torso_offset[None])
    cannot_stay = np.linalg.norm(misses_from_start[0], axis=-1) > max_miss
    cannot_reach = np.linalg.norm(misses_from_rest[0], axis=-1) > max_miss
    is_right = np.array([leg.side == "right" for leg in body.legs])
    group = (np.array(body.ranks) + is_right) % 2
    steps_early = np.where(cannot_stay == cannot_reach, group == 0, cannot_stay)
    _, step_of_leg = np.unique(2 * ~steps_early + group, return_inverse=True)
    return steps_early, step_of_leg


def _place_feet(body: Body, pose: Pose) -> np.ndarray:
    """Return the positions (legs, 3) of the feet in the frame of a pose, m."""
    return standing_legs.feet_from_torso(body, pose) + pose.position
