"""Recordings of one body under one policy: walks under commands, a stop and a start, showcases of presets."""

from typing import NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips import loops
from arc_suite.animation.clips.recordings import Recording, record
from arc_suite.cpg.selection import presets_of
from arc_suite.envs.setup import Setup
from arc_suite.models import posture
from arc_suite.policies import policy as named_policy
from arc_suite.tasks.fitting import velocity_units

_SETTLE = 200  # control steps, after which starts and changes of command are forgotten
_LONG = 700  # control steps without a command: a speed that varies is that of most of an episode
_CYCLES = 20  # of the gait in a recording under a command, to choose loops from
_UNDRAWN = {"poses": 0.0, "gaits": ()}  # of a task whose pose and gait are by command
_OF_ROOM, _LEAST_CROUCH = 0.7, 0.05  # share of the room in which a body crouches, and least crouch, standing heights
_TRIES, _LEAST_TURN = 3, 0.25  # recordings of a turn, for one by the angle; its least share of the angle
_BEFORE, _REST, _AFTER = 2, 5, 4  # gait cycles before a stop, at rest, and after the start


class GaitRecording(NamedTuple):
    """A recording of a gait.

    Attributes:
        recording: the poses.
        cycle: of the gait, s.
        phase: of the first foot at the first sample, cycles since its scheduled touchdown; None if the task has no
            clock.
    """

    recording: Recording
    cycle: float
    phase: float | None = None

    def wait(self, sample: int) -> int:
        """Return the samples from a sample to the next touchdown of the first foot that the clock schedules."""
        cycle = self.cycle / self.recording.time_step
        return round((-self.phase * cycle - sample) % cycle) % round(cycle)


class TransitionRecording(NamedTuple):
    """A body that walks, stops, stands, starts and walks.

    Attributes:
        recorded: the recording.
        stop: first sample of the stop, at a scheduled touchdown of the first foot.
        start: sample in which the command starts the body.
        late: samples from a scheduled touchdown to the command's change.
    """

    recorded: GaitRecording
    stop: int
    start: int
    late: int


class TurnRecording(NamedTuple):
    """A body that stands, turns on the spot, and stands.

    Attributes:
        recorded: the recording.
        first: sample at which it begins to turn.
        samples: until it stands again.
    """

    recorded: GaitRecording
    first: int
    samples: int


class Recorder:
    """Makes recordings of a body, each from the start of an episode.

    Attributes:
        body: of the recordings.
        has_command: whether the task has a command.
        velocity_units: (3,) of commands: forward and left, m/s, turning, rad/s; None without a command.
    """

    def __init__(self, setup: Setup, policy: str, preset: str | None):
        """Take what moves the body.

        With a command, the frequency of the gait is set so that a cycle is a whole number of control steps, unless
        the setup sets it: a pose then returns after one cycle.

        Args:
            setup: body and task.
            policy: see `policies.policy`.
            preset: of the policy; None for the one that suits the task and the body.

        Raises:
            ValueError: a policy or preset that does not fit.
            OSError: a file cannot be read.
        """
        task = setup.definition
        named_policy(policy, setup.body, preset, task=task)  # errors of the policy are no errors of a clip
        self.body, self._policy, self._preset = setup.body, policy, preset
        self.has_command = task.commands.get("command") == 3 and task.parameters is not None
        if self.has_command and "gait_frequency" not in setup.task_kwargs:
            step = task.scene.control_timestep
            steps = max(1, round(1.0 / (task.parameters.gait_frequency * step)))
            setup = _changed(setup, gait_frequency=1.0 / (steps * step))
        self.velocity_units = velocity_units(self.body, task.parameters.target_velocity) if self.has_command else None
        if "pose" in task.commands:
            setup = _changed(setup, **_UNDRAWN)
        self._setup = setup

    def record_walk(
        self, command: tuple[float, float, float], failing: int | None = None, crouch: float = 0.0
    ) -> GaitRecording:
        """Return a recording of the policy under a command.

        Args:
            command: forward, left and turning, in units of the task.
            failing: index of the leg whose motors fail; None for a sound body.
            crouch: by which the torso is lowered, standing heights, as far as the legs fold; demonstrators do so in
                the task `directed`.

        Raises:
            ValueError: the episode ends, the task has no command, or nobody crouches.
        """
        setup, held = self._setup if failing is None else _changed(self._setup, actuator_failure=failing), {}
        if crouch:
            setup, held = self._directed(), {"pose": (-self._crouch(crouch), *(0.0,) * 5)}
        cycle, offset, step = self._gait()
        recording = self._recorded(setup, _SETTLE, round(_CYCLES * cycle / step), [(0, command)], **held)
        return GaitRecording(recording, cycle, (_SETTLE * step / cycle + offset) % 1.0)

    def record_without_command(self) -> GaitRecording:
        """Return a recording of the policy in a task without a command.

        Raises:
            ValueError: the episode ends, or the pose does not return.
        """
        return _periodic(self._recorded(self._setup, _SETTLE, _LONG))

    def record_showcase(self, preset: str) -> GaitRecording:
        """Return a recording of a preset of the demonstrator that walks straight ahead in the task walk.

        Raises:
            ValueError: the body has no such preset, the episode ends, or the pose does not return.
        """
        if preset not in presets_of(self.body):
            raise ValueError(f"{self.body.name} has no preset {preset}")
        environment = Setup.of(self.body).load(seed=0)
        actor = named_policy("cpg", self.body, preset, task=environment.task.definition)
        return _periodic(record(environment, actor, _SETTLE, _LONG))

    def record_transition(self, command: tuple[float, float, float]) -> TransitionRecording:
        """Return a recording of a stop from a command, and of a start into it.

        Raises:
            ValueError: the episode ends, or the task has no command.
        """
        cycle, offset, step = self._gait()
        steps = cycle / step

        def phase(count):  # of the first foot, cycles
            return (count / steps + offset) % 1.0

        least = _SETTLE + round(_BEFORE * steps)
        stop = min(range(least, least + round(steps)), key=phase)
        start = stop + round(_REST * steps)
        commands = [(0, command), (stop, (0.0, 0.0, 0.0)), (start, command)]
        recording = self._recorded(self._setup, _SETTLE, start + round(_AFTER * steps) - _SETTLE, commands)
        substeps = recording.substeps
        late = round(substeps * steps * phase(stop))
        stop, start = (substeps * (count - _SETTLE) for count in (stop, start))
        return TransitionRecording(GaitRecording(recording, cycle, phase(_SETTLE)), stop - late, start, late)

    def record_turn(self, angle: float) -> TurnRecording:
        """Return a recording of a turn on the spot by about an angle, rad.

        Raises:
            ValueError: the episode ends, the task has no command, or the policy does not turn.
        """
        cycle, _, step = self._gait()
        around, rest = round(cycle / step), round(_REST * cycle / step)
        rate = float(np.copysign(self.velocity_units[2], angle))
        count = round(angle / rate / step)
        for _ in range(_TRIES):
            commands = [(0, (0.0, 0.0, 0.0)), (_SETTLE + around, (0.0, 0.0, np.sign(angle)))]
            commands.append((_SETTLE + around + count, (0.0, 0.0, 0.0)))
            recording = self._recorded(self._setup, _SETTLE, 2 * around + count + rest, commands)
            first, samples = recording.substeps * around, recording.substeps * (count + rest)
            turned = np.ptp(np.unwrap(rotations.yaw(recording.poses[first : first + samples + 1, 3:7]))[[0, -1]])
            if turned < _LEAST_TURN * abs(angle):
                turned, least = np.degrees((turned, _LEAST_TURN * abs(angle)))
                raise ValueError(f"the policy turns by {turned:.0f} degrees, less than {least:.0f}")
            missing = round((abs(angle) - turned) / abs(rate) / step)
            if not missing:
                break
            count += missing
        return TurnRecording(GaitRecording(recording, cycle), first, samples)

    def _directed(self) -> Setup:
        """The setup with a pose by command."""
        if "pose" in self._setup.definition.commands:
            return self._setup
        if self._policy != "cpg":
            raise ValueError(f"the policy {self._policy} takes no pose")
        return Setup.of(self.body, "directed", self._setup.task_kwargs | _UNDRAWN)

    def _crouch(self, depth: float) -> float:
        room = _OF_ROOM * abs(posture.room(self.body, planted=False)[0, 0])
        if room < _LEAST_CROUCH:
            raise ValueError(f"the legs fold by {room:.2f} of their height; a crouch takes {_LEAST_CROUCH:g}")
        return min(depth, room)

    def _gait(self) -> tuple[float, float, float]:
        """The cycle, s, the offset of the first foot, cycles, and the control step, s; ValueError without a command."""
        if not self.has_command:
            raise ValueError(f"the task {self._setup.kind.name} has no command")
        task, gait = self._setup.definition, self._setup.definition.parameters
        return 1.0 / gait.gait_frequency, gait.phase_offsets[0] / (2.0 * np.pi), task.scene.control_timestep

    def _recorded(self, setup: Setup, settle: int, steps: int, commands=(), **held) -> Recording:
        environment = setup.load(seed=0)
        actor = named_policy(self._policy, self.body, self._preset, task=environment.task.definition)
        return record(environment, actor, settle, steps, commands, **held)


def _periodic(recording: Recording) -> GaitRecording:
    cycle = loops.period(recording)
    if cycle is None:
        seconds = len(recording.poses) * recording.time_step / 2.0
        raise ValueError(f"the pose does not return within {seconds:.3g} s")
    return GaitRecording(recording, cycle)


def _changed(setup: Setup, **settings) -> Setup:
    """Return the setup with other settings of its task."""
    return Setup.of(setup.body, setup.task, setup.task_kwargs | settings)
