"""Recordings of one body under one policy: walks under commands, a stop and a start, blows, showcases of presets."""

from typing import Any, NamedTuple

import numpy as np

from arc_suite.animation.clips import loops
from arc_suite.animation.clips.blows import Blow
from arc_suite.animation.clips.recordings import Recording, record
from arc_suite.animation.clips.standing_legs import has_free_feet
from arc_suite.cpg import Demonstrator
from arc_suite.cpg.selection import preset_of, presets_of, suited_preset
from arc_suite.cpg.stepping import SteppingParameters
from arc_suite.envs.setup import Setup
from arc_suite.models import posture
from arc_suite.policies import check_preset
from arc_suite.policies import policy as named_policy
from arc_suite.policies.protocol import Policy
from arc_suite.robots.gaits import Pace
from arc_suite.tasks import Task
from arc_suite.tasks.fitting import velocity_units
from arc_suite.tasks.modified_task import has_active
from arc_suite.tasks.modifiers import Kicks, Pushes

_SETTLE_STEPS = 200  # control steps, after which starts and changes of command are forgotten
_SAG_STEPS = 700  # control steps, after which a leg without motors hardly sags any further
_STEPS_WITHOUT_COMMAND = 700  # control steps of a recording: a speed that varies is that of most of an episode
_CYCLES_UNDER_COMMAND = 20  # gait cycles of a recording, to choose loops from
_CYCLES_BEFORE_STOP = 2  # gait cycles of a recording of a stop and a start
_CYCLES_AT_REST = 5
_CYCLES_AFTER_START = 4
_STANDING_STEPS = 60  # control steps before a blow, at least
_CYCLES_AFTER_BLOW = 3  # gait cycles in which a body comes to rest after a blow, and after its steps
_STEPPING_COMMAND = (1e-6, 0.0, 0.0)  # so slow that a body steps on the spot
_BLOW_FRICTION = 4.0  # of feet that do not skid, so that the torso goes over them
_CROUCH_ROOM_SHARE = 0.7  # of the room that legs leave the torso: as deep as a body crouches
_MIN_CROUCH = 0.05  # standing heights
_FIXED_POSE_AND_GAIT = {"poses": 0.0, "gaits": ()}  # settings of a task that else draws commands of pose and gait


class GaitRecording(NamedTuple):
    """A recording of a gait.

    Attributes:
        recording: the poses.
        cycle: cycle of the gait, s.
        phase: phase of the first foot at the first sample, cycles since its scheduled touchdown; None if the task has
            no clock.
    """

    recording: Recording
    cycle: float
    phase: float | None = None

    def samples_to_touchdown(self, sample: int) -> int:
        """Return the samples from a sample to the next touchdown of the first foot that the clock schedules."""
        cycle_samples = self.cycle / self.recording.time_step
        samples = round((-self.phase * cycle_samples - sample) % cycle_samples)
        return samples % round(cycle_samples)


class TransitionRecording(NamedTuple):
    """A body that walks, stops, stands, starts and walks.

    Attributes:
        gait: the recording.
        stop: first sample of the stop, at a scheduled touchdown of the first foot.
        start: sample in which the command starts the body.
        delay: samples from a scheduled touchdown to the command's change.
    """

    gait: GaitRecording
    stop: int
    start: int
    delay: int


class _Clock(NamedTuple):
    """The gait clock of a task.

    Attributes:
        cycle: s.
        offset: phase of the first foot at the start of an episode, cycles.
        control_timestep: s.
    """

    cycle: float
    offset: float
    control_timestep: float


class Recorder:
    """Makes recordings of a body, each from the start of an episode.

    Attributes:
        body: body of the recordings.
        has_command: whether the task has a command of velocities.
        velocity_units: (3,) units of commands: forward and left, m/s, turning, rad/s; None without a command.
    """

    def __init__(self, setup: Setup, policy: str, preset: str | None):
        """Take what moves the body.

        With a command, the frequency of the gait is set so that a cycle is a whole number of control steps, unless
        the setup sets it: a pose then returns after one cycle.

        Args:
            setup: body and task.
            policy: see `policies.policy`.
            preset: preset of the policy; None for the one that suits the task and the body.

        Raises:
            ValueError: a policy or preset that does not fit, or a task with kicks or pushes.
            OSError: a file cannot be read.
        """
        task = setup.definition
        if has_active(task, Kicks) or has_active(task, Pushes):
            raise ValueError(
                f"task {setup.kind.name}: expected kicks=0 and force=0, as clips show bodies that nothing disturbs"
            )
        check_preset(policy, preset)
        named_policy(policy, setup.body, preset, task=task)  # raises errors of the policy, which are none of a clip
        self.body = setup.body
        self._policy = policy
        self._preset = preset
        self._policies: dict[tuple[Setup, float], Policy] = {}  # by setup and lift: to fit a law takes long
        self.has_command = task.commands.get("command") == 3 and task.parameters is not None
        self.velocity_units = None
        if self.has_command:
            self.velocity_units = velocity_units(self.body, task.parameters.target_velocity)
            self._keeps_frequency = "gait_frequency" in setup.task_kwargs
            self._gait_frequency = task.parameters.gait_frequency  # Hz
            self._control_timestep = task.scene.control_timestep  # s
            setup = _with_settings(setup, gait_frequency=self._choose_frequency(tempo=1.0))
        if "pose" in task.commands:
            setup = _with_settings(setup, **_FIXED_POSE_AND_GAIT)
        self._setup = setup

    def record_walk(
        self,
        command: tuple[float, float, float],
        failing: int | None = None,
        crouch: float = 0.0,
        pace: Pace | None = None,
    ) -> GaitRecording:
        """Return a recording of the policy under a command.

        Args:
            command: forward, left and turning, in units of the task.
            failing: index of the leg whose motors fail; None for a sound body.
            crouch: distance by which the torso is lowered, standing heights, as far as the legs fold;
                demonstrators do so in the task `directed`.
            pace: speed and gait in which demonstrators go; None for those of the task.

        Raises:
            ValueError: the episode ends, the task has no command, or the body or policy cannot crouch.
        """
        setup = self._setup
        fixed_commands: dict[str, Any] = {}
        lift = 1.0
        if failing is not None:
            setup = _with_settings(setup, actuator_failure=failing)
        if pace is not None and self.has_command and self._policy == "cpg":
            setup = self._setup_at_pace(pace)
            command = tuple(component / pace.speed for component in command)
            lift = pace.height if has_free_feet(self.body) else 1.0  # others become slower by higher steps
        if crouch:
            setup = self._setup_with_pose_command()
            fixed_commands["pose"] = (-self._limit_crouch(crouch), 0.0, 0.0, 0.0, 0.0, 0.0)
        clock = self._clock(setup)
        steps = round(_CYCLES_UNDER_COMMAND * clock.cycle / clock.control_timestep)
        settle = _SETTLE_STEPS
        recording = self._record(setup, settle, steps, [(0, command)], lift=lift, **fixed_commands)
        if (lift != 1.0 or failing is not None) and not _closes(recording, clock):
            if failing is not None:
                settle = self._choose_settling(setup, steps)
            recording = self._record(setup, settle, steps, [(0, command)], **fixed_commands)
        phase = (settle * clock.control_timestep / clock.cycle + clock.offset) % 1.0
        return GaitRecording(recording, clock.cycle, phase)

    def record_free_walk(self) -> GaitRecording:
        """Return a recording of the policy in a task without a command.

        Raises:
            ValueError: the episode ends, or the pose does not return.
        """
        return _find_gait(self._record(self._setup, _SETTLE_STEPS, _STEPS_WITHOUT_COMMAND))

    def record_showcase(self, preset: str) -> GaitRecording:
        """Return a recording of a preset of the demonstrator that walks straight ahead in the task walk.

        Raises:
            ValueError: the body has no such preset, the episode ends, or the pose does not return.
        """
        if preset not in presets_of(self.body):
            raise ValueError(f"{self.body.name} has no preset {preset}")
        environment = Setup.of(self.body).load(seed=0)
        policy = named_policy("cpg", self.body, preset, task=environment.task.definition)
        return _find_gait(record(environment, policy, _SETTLE_STEPS, _STEPS_WITHOUT_COMMAND))

    def record_transition(self, command: tuple[float, float, float]) -> TransitionRecording:
        """Return a recording of a stop from a command, and of a start into it.

        Raises:
            ValueError: the episode ends, or the task has no command.
        """
        clock = self._clock(self._setup)
        steps_in_cycle = clock.cycle / clock.control_timestep

        def phase_at(step):  # of the first foot, cycles
            return (step / steps_in_cycle + clock.offset) % 1.0

        earliest_stop = _SETTLE_STEPS + round(_CYCLES_BEFORE_STOP * steps_in_cycle)
        stop_step = min(range(earliest_stop, earliest_stop + round(steps_in_cycle)), key=phase_at)
        start_step = stop_step + round(_CYCLES_AT_REST * steps_in_cycle)
        end_step = start_step + round(_CYCLES_AFTER_START * steps_in_cycle)
        commands = [(0, command), (stop_step, (0.0, 0.0, 0.0)), (start_step, command)]
        recording = self._record(self._setup, _SETTLE_STEPS, end_step - _SETTLE_STEPS, commands)
        substeps = recording.substeps
        delay = round(substeps * steps_in_cycle * phase_at(stop_step))
        return TransitionRecording(
            gait=GaitRecording(recording, clock.cycle, phase_at(_SETTLE_STEPS)),
            stop=substeps * (stop_step - _SETTLE_STEPS) - delay,
            start=substeps * (start_step - _SETTLE_STEPS),
            delay=delay,
        )

    def record_blow(self, side: str, size: float, lever: float, cycles: int) -> GaitRecording:
        """Return a recording of a body that stands, from the blow on until it stands again.

        Args:
            side: see `blows.Blow`.
            size: see `blows.Blow`.
            lever: see `blows.Blow`.
            cycles: gait cycles in which it steps on the spot after the blow; 0 for feet that stay.

        Raises:
            ValueError: the body falls, or the task has no command.
        """
        clock = self._clock(self._setup)
        steps_in_cycle = clock.cycle / clock.control_timestep
        standing_steps = round(np.ceil(_STANDING_STEPS / steps_in_cycle) * steps_in_cycle)
        stop_step = standing_steps + round(cycles * steps_in_cycle)
        commands = [(0, (0.0, 0.0, 0.0)), (standing_steps, _STEPPING_COMMAND), (stop_step, (0.0, 0.0, 0.0))]
        steps = round((cycles + _CYCLES_AFTER_BLOW) * steps_in_cycle)
        blow = Blow(side, size, lever, _BLOW_FRICTION)
        return GaitRecording(self._record(self._setup, standing_steps, steps, commands, blow), clock.cycle)

    def _setup_with_pose_command(self) -> Setup:
        """Return the setup, or for demonstrators that of the task `directed`, which takes a pose by command."""
        if "pose" in self._setup.definition.commands:
            return self._setup
        if self._policy != "cpg":
            raise ValueError(f"the policy {self._policy} takes no pose")
        return Setup.of(self.body, "directed", self._setup.task_kwargs | _FIXED_POSE_AND_GAIT)

    def _limit_crouch(self, depth: float) -> float:
        """Return a depth, standing heights, or as far as the legs fold."""
        lowest_height = posture.measure_room(self.body, planted=False)[0, 0]  # from rest, standing heights
        room = _CROUCH_ROOM_SHARE * abs(lowest_height)
        if room < _MIN_CROUCH:
            raise ValueError(f"the legs fold by {room:.2f} of their height; a crouch takes {_MIN_CROUCH:g}")
        return min(depth, room)

    def _choose_settling(self, setup: Setup, steps: int) -> int:
        """Return the control steps in which a leg sags, or as many as an episode leaves before a recording."""
        most_steps = setup.definition.step_limit - steps - 1
        return int(max(_SETTLE_STEPS, min(_SAG_STEPS, most_steps)))

    def _choose_frequency(self, tempo: float) -> float:
        """Return a multiple of the frequency of the gait, Hz, at which a cycle is a whole number of control steps.

        A frequency that the caller sets is not rounded.
        """
        frequency = tempo * self._gait_frequency
        if self._keeps_frequency:
            return frequency
        return 1.0 / (max(1, round(1.0 / (frequency * self._control_timestep))) * self._control_timestep)

    def _setup_at_pace(self, pace: Pace) -> Setup:
        """Return the setup with the speed and the gait of a pace, which is what demonstrators are fitted to."""
        parameters = self._setup.definition.parameters
        return _with_settings(
            self._setup,
            gait_frequency=self._choose_frequency(pace.tempo),
            duty_factor=parameters.duty_factor + pace.duty_change,
            target_velocity=parameters.target_velocity * pace.speed,
        )

    def _clock(self, setup: Setup) -> _Clock:
        """Return the gait clock of the task; a ValueError without a command."""
        if not self.has_command:
            raise ValueError(f"the task {setup.kind.name} has no command")
        task = setup.definition
        return _Clock(
            cycle=1.0 / task.parameters.gait_frequency,
            offset=task.parameters.phase_offsets[0] / (2.0 * np.pi),
            control_timestep=task.scene.control_timestep,
        )

    def _record(
        self, setup: Setup, settle: int, steps: int, commands=(), blow=None, lift: float = 1.0, **fixed_commands
    ) -> Recording:
        """Return a recording of the policy in a setup; other arguments as of `recordings.record`.

        Args:
            setup, settle, steps, commands, blow, **fixed_commands: see there.
            lift: multiple of the height of a demonstrator's feet in mid-swing, where its law has one.
        """
        environment = setup.load(seed=0)
        if (setup, lift) not in self._policies:
            self._policies[setup, lift] = self._make_policy(environment.task.definition, lift)
        return record(environment, self._policies[setup, lift], settle, steps, commands, blow, **fixed_commands)

    def _make_policy(self, task: Task, lift: float) -> Policy:
        """Return the policy in a task; if it is a demonstrator that has one, with another lift."""
        if lift != 1.0:
            preset = preset_of(self.body, self._preset or suited_preset(task))
            if isinstance(preset, SteppingParameters):
                return Demonstrator(task, preset._replace(lift=lift * preset.lift))
        return named_policy(self._policy, self.body, self._preset, task=task)


def _closes(recording: Recording, clock: _Clock) -> bool:
    """Return whether a pose returns after one cycle."""
    return loops.find_closings(recording, clock.cycle, most_cycles=1)[1].seam <= loops.MAX_SEAM


def _find_gait(recording: Recording) -> GaitRecording:
    """Return a recording with the cycle of its gait; a ValueError if the pose does not return."""
    cycle = loops.period(recording)
    if cycle is None:
        searched_seconds = len(recording.poses) * recording.time_step / 2.0
        raise ValueError(f"the pose does not return within {searched_seconds:.3g} s")
    return GaitRecording(recording, cycle)


def _with_settings(setup: Setup, **settings) -> Setup:
    """Return the setup with other settings of its task."""
    return Setup.of(setup.body, setup.task, setup.task_kwargs | settings)
