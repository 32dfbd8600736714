"""Laws that plan paths of feet in space, and follow them by inverse kinematics.

In stance a foot moves against the requested velocity, in swing it returns and is lifted. Where a task
observes a pose and a gait by command, feet step in that gait under a torso in that pose: both are read
anew in every step, so that they may change at any time. Feedback on height, roll and pitch makes up for
what joints give way.
"""

from abc import abstractmethod
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.cpg.command_law import CommandLaw, Request
from arc_suite.models import posture
from arc_suite.models.kinematics import Legs, path_weights, point_velocities, tilt_heights
from arc_suite.models.standing import GRAVITY
from arc_suite.tasks.contract import Task

_STEPS = 3  # of inverse kinematics in a control step
_MOST_OFF = 0.2  # standing heights or rad, by which feedback changes a pose
_LARGEST = 0.05  # standing heights or rad, of the error that feedback adds up
_OF_LEGS = ("mount", "turn", "axes", "ends", "radius", "joints", "moves", "low", "high")  # fields of `Legs`, of one leg
_FEEDBACK = np.array((0, 3, 4))  # numbers of a pose that the torso shows: height, roll and pitch


def observes_gait_and_pose(task: Task) -> bool:
    """Return whether a task observes pose and gait by command."""
    return task.gait_and_pose is not None and task.blocks.keys() >= {*task.gait_and_pose.observed}


class SteppingState(NamedTuple):
    """The own state of a law that steps.

    Attributes:
        angles: (environments, legs, links) planned, rad.
        off: (environments, 3) integral of the error of height, standing heights, roll and pitch, rad.
    """

    angles: np.ndarray
    off: np.ndarray


class Stepping(CommandLaw):
    """Plans paths of feet.

    Attributes:
        directed: whether pose and gait are by command.
        proportional: feedback on the error of a pose.
        legs: their kinematics.
        places: (legs, 3) of the soles at ease, m.
        angles: (legs, links) of the joints then, rad.
        shorter: stance than the gait prescribes, cycles.
        across: weight of a foot's slip across its path against its motion along it.
        lift: of a foot in mid-swing, m.
        attitude: how far a foot is pushed down, as a share of how far the torso's tilt sinks its place.
        damping: of inverse kinematics, in standing heights.
        most: largest request, in units of the command.
    """

    across, shorter, attitude, damping, most = 1.0, 0.0, 0.0, posture.IK_DAMPING, np.inf

    def __init__(self, task: Task, parameters):
        """Fit the law to a task; see `CommandLaw`."""
        super().__init__(task, parameters)
        self.directed = observes_gait_and_pose(task)
        # In place of an integral; with both, gaits are disturbed.
        self.proportional = 0.0 if parameters.integral else min(1.0, parameters.gain[0])
        if self.directed:
            self.reads, self._rest = (
                (*self.reads, *task.gait_and_pose.observed),
                posture.find_rest_pose(task.scene.body),
            )
        self._damping, self.lift = self.damping * self.pose.height, parameters.lift * self.pose.height
        self.legs, self.rest_soles, self.rest_angles = self._eased(task)

    @abstractmethod
    def _eased(self, task: Task) -> tuple[Legs, np.ndarray, np.ndarray]:
        """The legs, the places (legs, 3) of their soles at ease, m, and the angles (legs, links) then, rad."""

    def initial_paths(self, count: int) -> SteppingState:
        """Return the angles at ease, and no error."""
        return SteppingState(np.tile(self.rest_angles, (count, 1, 1)), np.zeros((count, 3)))

    def planned(self, paths: SteppingState, request: Request, observation: Mapping) -> tuple:
        """Return the next paths, target angles (environments, joints), rad, and their change; see `CommandLaw`."""
        vertical = rotations.matrix(observation["posture"][:, 1:5])[:, 2]  # the world's, in the torso's frame
        cycle, duty, stance = self._timing(request, observation)
        pose = observation["pose"] if self.directed else None
        # Balance is about the attitude that is asked for.
        tilted = vertical if pose is None else (posture.rotation_of(pose[:, 3:]) @ vertical[..., None])[..., 0]
        motion, shift = self.balance(request.motion, tilted, observation)
        feet = self.next_feet(cycle, motion, shift, request.size, tilted, duty, stance)
        off = paths.off
        if pose is not None:
            off, pose = self._corrected(off, pose, observation["posture"][:, 0], vertical)
            feet = posture.move_ground_points(feet, pose, self.pose.height)
        aims = path_weights(point_velocities(motion, self.rest_soles), self.across)
        angles = self.legs.solve_joint_angles(paths.angles, feet, aims, self._damping, _STEPS)
        targets = self.legs.by_joint(paths.angles)
        return SteppingState(angles, off), targets, self.legs.by_joint(angles) - targets

    def _timing(self, request: Request, observation: Mapping) -> tuple:
        """Phases (environments, legs) in the next control step, cycles, the duty factor, and the stance, s."""
        if not self.directed:
            cycle = (request.phase[:, None] + self.offsets + request.advance[:, None]) % 1.0
            return cycle, self.duty_factor, self.stance_duration
        legs, gait = len(self.offsets), observation["gait"]
        phase = gait.__array_namespace__().arctan2(gait[:, :legs], gait[:, legs : 2 * legs]) / (2.0 * np.pi)
        duty, frequency = gait[:, -2:-1] - self.shorter, gait[:, -1:] * (GRAVITY / self.pose.height) ** 0.5
        going = request.advance[:, None] > 0.0
        cycle = (phase + self.parameters.lead + frequency * self.control_timestep * going) % 1.0
        return cycle, duty, (duty / frequency)[..., None]

    def balance(self, motion, vertical, observation: Mapping) -> tuple:
        """Return the velocity (environments, 3) that feet give, m/s and rad/s, and shifts (environments, 2) of them, m.

        Args:
            motion: (environments, 3) requested, in units of the command.
            vertical: (environments, 3) in the torso's frame, less the attitude that is asked for.
            observation: blocks by name.
        """
        return motion.clip(-self.most, self.most) * self.units, motion[:, :2] * 0.0

    def _corrected(self, off, pose, height, vertical) -> tuple:
        """The integral of the error of a pose (environments, 6), and the pose that makes up for both."""
        numpy, p = pose.__array_namespace__(), self.parameters
        shown = numpy.concatenate(
            [(height / self.pose.height - self._rest.ride_height)[:, None], posture.roll_and_pitch_of(vertical)],
            axis=-1,
        )
        error = (pose[:, _FEEDBACK] - shown).clip(-_LARGEST, _LARGEST)
        off = (off + p.integral * self.cycles_per_step * error).clip(-_MOST_OFF, _MOST_OFF)
        added, zero = off + self.proportional * error, numpy.zeros_like(off[:, :1])
        return off, pose + numpy.concatenate([added[:, :1], zero, zero, added[:, 1:], zero], axis=-1)

    def next_feet(self, cycle, motion, shift, size, vertical, duty, stance):
        """Return places (environments, legs, 3) of the soles in the next control step, m, under a level torso.

        Args:
            cycle: (environments, legs) phases of the legs then.
            motion: (environments, 3) requested velocity, m/s and rad/s.
            shift: (environments, 2) of footholds for balance, m.
            size: (environments, 1) of the gait.
            vertical: (environments, 3) the world's, in the torso's frame.
            duty: factor, a number or (environments, 1).
            stance: that it lasts, s, a number or (environments, 1, 1).
        """
        numpy = cycle.__array_namespace__()
        stands, swung = cycle < duty, ((cycle - duty) / (1.0 - duty)).clip(0.0)
        along = numpy.where(stands, 1.0 - 2.0 * cycle / duty, 2.0 * swung - 1.0)[..., None]  # from 1 to -1 in stance
        half = 0.5 * stance * point_velocities(motion, self.rest_soles)
        ground = self.rest_soles[:, :2] + size[..., None] * (along * half + self._kept(along) * shift[:, None])
        lift = self.lift * numpy.sin(np.pi * swung)
        heights = self.rest_soles[:, 2] + size * (lift + self.attitude * tilt_heights(vertical, self.rest_soles))
        return numpy.concatenate([ground, heights[..., None]], axis=-1)

    def _kept(self, along):
        """The share of the shift for balance that a foot keeps, from 1 to -1 along its path."""
        return 1.0


class Directed(Stepping):
    """Follows a velocity in a pose and a gait by command, on level ground, without sight."""

    across = 0.3
    damping = 0.1  # with less of it, legs that are stretched out jump
    most = 2.0  # of a request, in units of the command: feedback on a body that cannot go on would throw it

    def _eased(self, task: Task) -> tuple:
        return self._rest.legs, self._rest.sole_positions, self._rest.joint_angles

    def constants(self) -> dict:
        """Return what the law computes with, arrays and numbers by name: all that a port to another language needs."""
        p, cycles = self.parameters, self.cycles_per_step
        legs = zip(*self.legs, self.rest_soles, self.rest_angles, strict=True)
        return {
            "legs": [dict(zip((*_OF_LEGS, "place", "angles"), leg, strict=True)) for leg in legs],
            **self.drive._asdict(),
            "units": self.units,
            "most": self.most,
            "gain": p.gain,
            "smoothing": self.smoothing,
            "integral": p.integral * cycles,
            "proportional": self.proportional,
            "onset": self.onset,
            "lead": p.lead,
            "height": self.pose.height,
            "ride": self._rest.ride_height,
            "lift": self.lift,
            "across": self.across,
            "damping_of_feet": self._damping,
            "steps": _STEPS,
            "largest": _LARGEST,
            "most_off": _MOST_OFF,
            "rate": (GRAVITY / self.pose.height) ** 0.5,
            "step": self.control_timestep,
        }
