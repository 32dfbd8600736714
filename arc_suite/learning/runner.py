"""Play a policy on a robot. It needs NumPy and onnxruntime alone; policy.onnx and policy.json lie in its folder.

    from run import Policy, Sensors, run

    print(run(Policy.load(), read, write, command))

`read()` returns the newest `Sensors`, or None without a new message, and `write(output)` hands an `Output` to the
motors. Both have the order of `motors` in policy.json. `command()` returns the desired velocity: forward and left, m/s,
and turning left, rad/s. It is cut to the `command_ranges` of policy.json; a policy without commands ignores it.
`python run.py` prints the motors, for which NumPy is enough.
"""

import json
import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

RAMP_TIME = 2.0  # s, from the present pose to the standing pose
MAX_TILT = 60.0  # degrees
MAX_EXCESS = 0.2  # rad, of a joint beyond its range
MAX_LATENESS = 1.0  # control steps
MAX_SILENCE = 5  # control steps without a new message of the sensors


class Sensors(NamedTuple):
    """What sensors show.

    Attributes:
        angles: (motors,) of the joints, as the robot's file counts them, rad.
        speeds: (motors,) rad/s.
        quaternion: (4,) orientation in the world of the root frame of the robot's file, w first.
        rates: (3,) angular velocity of this frame in itself, rad/s.
    """

    angles: np.ndarray
    speeds: np.ndarray
    quaternion: np.ndarray
    rates: np.ndarray


class Output(NamedTuple):
    """What motors do until the next control step: stiffness (target - angle) - damping speed + torque, within limits.

    Attributes:
        targets: (motors,) rad.
        stiffness: (motors,) N m/rad.
        damping: (motors,) N m s/rad.
        torques: (motors,) N m.
        limits: (motors,) largest torque, N m.
    """

    targets: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    torques: np.ndarray
    limits: np.ndarray


def read_facts(folder: str | Path = Path(__file__).parent) -> dict:
    """Return the content of policy.json."""
    return json.loads((Path(folder) / "policy.json").read_text(encoding="utf-8"))


class Policy:
    """A policy with its memory: clock, latest action and history."""

    def __init__(self, facts: dict, infer: Callable[[np.ndarray], np.ndarray]):
        """Set the content of policy.json, and the function from an observation (size,) to an action (joints,)."""
        self.facts = facts
        self._infer = infer
        motors = facts["motors"]
        self._action_of_motor = np.array([motor["action"] for motor in motors])
        self._motor_of_action = np.argsort(self._action_of_motor)
        names = ("home", "reach", "stiffness", "damping", "limit", "low", "high")
        self.home, self._reach, self._stiffness, self._damping, self._limits, self._low, self._high = (
            np.array([motor[name] for motor in motors]) for name in names
        )
        self.reset()

    @classmethod
    def load(cls, folder: str | Path = Path(__file__).parent) -> "Policy":
        """Read policy.json and policy.onnx."""
        import onnxruntime

        session = onnxruntime.InferenceSession(Path(folder) / "policy.onnx", providers=["CPUExecutionProvider"])
        return cls(read_facts(folder), lambda observation: session.run(None, {"observations": observation[None]})[0][0])

    def reset(self, heading: float | None = None) -> None:
        """Begin anew. A policy without commands walks into a heading, rad; None for that of the first reading."""
        self._heading = heading
        self._quaternion = np.array((1.0, 0.0, 0.0, 0.0))
        self._tick = -1  # of the gait's clock; the first reading is at tick 0
        self._was_going = True
        self._motion = np.zeros(3)  # mean velocity, in units of the command
        self._action = np.zeros(len(self.home))
        self._past: list[np.ndarray] | None = None  # readings and action of earlier control steps, the newest first
        self._latest = np.zeros(0)  # readings that the history keeps

    def act(self, sensors: Sensors, command=(0.0, 0.0, 0.0)) -> Output:
        """Return what the motors do in the next control step."""
        self._action = np.clip(self._infer(self.observe(sensors, command)), -1.0, 1.0).astype(float)
        if self._past:
            self._past = [np.concatenate([self._latest, self._action]), *self._past[:-1]]
        shares = self._action[self._action_of_motor]
        if self.facts["actions"] == "torque":
            return self._torques(sensors, self._limits * shares)
        return self.hold(sensors, self.home + self._reach * shares)

    def hold(self, sensors: Sensors, targets: np.ndarray) -> Output:
        """Return what holds joints at targets (motors,), rad."""
        zeros = np.zeros(len(targets))
        if self.facts["torque_held"] == "substep":  # by the motors' own controllers
            return Output(targets, self._stiffness, self._damping, zeros, self._limits)
        return self._torques(sensors, self._stiffness * (targets - sensors.angles) - self._damping * sensors.speeds)

    def relax(self, sensors: Sensors) -> Output:
        """Return what lets the robot sink: damping alone, or no torque."""
        zeros = np.zeros(len(self.home))
        damping = self._damping if self.facts["torque_held"] == "substep" else zeros
        return Output(sensors.angles, zeros, damping, zeros, self._limits)

    def _torques(self, sensors: Sensors, torques: np.ndarray) -> Output:
        zeros = np.zeros(len(torques))
        return Output(sensors.angles, zeros, zeros, np.clip(torques, -self._limits, self._limits), self._limits)

    def find_fault(self, sensors: Sensors) -> str:
        """Return a reason to stop; empty without one."""
        if not all(np.isfinite(values).all() for values in sensors):
            return "a sensor shows no number"
        up = _matrix(np.array(self.facts["imu"]))[2]  # of the torso, in the frame of the IMU
        tilt = math.degrees(math.acos(np.clip((_matrix(sensors.quaternion) @ up)[2], -1.0, 1.0)))
        if tilt > MAX_TILT:
            return f"the torso tilts by {tilt:.0f} degrees"
        excess = np.maximum(self._low - sensors.angles, sensors.angles - self._high)
        worst = int(excess.argmax())
        if excess[worst] > MAX_EXCESS:
            span = f"{self._low[worst]:.2f} to {self._high[worst]:.2f}"
            name = self.facts["motors"][worst]["motor"]
            return f"motor {name} is at {sensors.angles[worst]:.2f} rad, beyond {span}"
        return ""

    def observe(self, sensors: Sensors, command=(0.0, 0.0, 0.0)) -> np.ndarray:
        """Return the observation (size,) of the next control step."""
        facts = self.facts
        imu = np.array(facts["imu"])
        rates = _matrix(imu) @ sensors.rates
        quaternion = _product(np.asarray(sensors.quaternion), imu * (1.0, -1.0, -1.0, -1.0))
        is_start = self._tick < 0
        self._tick += self._was_going
        low, high = np.transpose(facts["command_ranges"])
        desired = np.divide(np.clip(command, low, high), facts["command_units"])
        self._was_going = not facts["follows_commands"] or bool(desired.any())
        angle = 2.0 * math.pi * facts["gait_frequency"] * facts["control_timestep"] * self._tick
        # Opposite quaternions are one orientation: take the one that continues.
        sign = 1.0 if self._quaternion @ quaternion >= 0.0 else -1.0
        self._quaternion = sign * quaternion
        if facts["follows_commands"] or self._heading is None:
            self._heading = _yaw(self._quaternion)
        orientation = _turn(self._quaternion, -self._heading)
        angles = (sensors.angles - self.home)[self._motor_of_action]
        speeds = np.asarray(sensors.speeds)[self._motor_of_action]
        height, velocity = self._estimate(_matrix(orientation), angles, speeds, rates)
        if not is_start:
            turning = _matrix(orientation)[2] @ rates
            motion = np.array((velocity[0], velocity[1], turning)) / facts["command_units"]
            self._motion += facts["leak"] * (motion - self._motion)
        parts = {
            "height": [height],
            "orientation": orientation,
            "angles": angles,
            "velocity": velocity,
            "rates": rates,
            "speeds": speeds,
            "clock": self._was_going * np.array((math.sin(angle), math.cos(angle))),
            "desired": desired,
            "motion": self._motion,
        }
        self._latest = _join(facts["history"]["parts"], parts)
        if is_start:
            row = np.concatenate([self._latest, np.zeros(len(self.home))])
            self._past = [row] * facts["history"]["steps"]
        parts["history"] = np.concatenate([np.zeros(0), *(self._past or ())])
        return _join(facts["observation"], parts).astype(np.float32)

    def _estimate(self, rotation, angles, speeds, rates) -> tuple[float, np.ndarray]:
        """Return height and velocity of the torso from the feet that stand, those next to the lowest."""
        heights = []
        velocities = []
        for leg in self.facts["legs"]:
            foot = np.array(leg["foot"])
            velocity = np.zeros(3)  # of the foot's center relative to the torso, in its frame
            spin = np.zeros(3)  # angular velocity of the foot, the same
            for joint, axis, anchor in list(zip(leg["joints"], leg["axes"], leg["anchors"], strict=True))[::-1]:
                turn = _about(np.array(axis), angles[joint])
                arm = turn @ (foot - anchor)
                spin = turn @ spin + speeds[joint] * np.array(axis)
                velocity = turn @ velocity + speeds[joint] * np.cross(axis, arm)
                foot = anchor + arm
            to_sole = -leg["radius"] * rotation[2]  # the lowest point, on which a foot rolls
            heights.append(-rotation[2] @ (foot + to_sole))
            velocities.append(-rotation @ (velocity + np.cross(spin, to_sole) + np.cross(rates, foot + to_sole)))
        weights = np.clip(1.0 - (max(heights) - np.array(heights)) / self.facts["stance_band"], 0.0, 1.0)
        return max(heights), weights @ np.array(velocities) / weights.sum()


def run(
    policy: Policy,
    read: Callable[[], Sensors | None],
    write: Callable[[Output], None],
    command: Callable[[], tuple] = lambda: (0.0, 0.0, 0.0),
    steps: float = math.inf,
) -> str:
    """Ramp to the standing pose and act for some control steps, then relax. Return the reason of an earlier stop.

    Readings without any change are no new message: noise changes those of sensors. The policy acts on the latest
    reading until `MAX_SILENCE`. Without a first message, nothing is written.
    """
    period = policy.facts["control_timestep"]
    ramp_steps = math.ceil(RAMP_TIME / period)
    policy.reset()
    sensors = read()
    if sensors is None:
        return "no message of the sensors"
    first_angles = np.array(sensors.angles)
    step = 0
    silence = 0  # control steps
    deadline = time.perf_counter()
    try:
        while step < ramp_steps + steps:
            reading = read()
            is_new = reading is not None and not all(map(np.array_equal, reading, sensors))
            silence = 0 if is_new else silence + 1
            if silence > MAX_SILENCE:
                return f"no new message of the sensors in {MAX_SILENCE * period:g} s"
            sensors = reading if is_new else sensors
            fault = policy.find_fault(sensors)
            if fault:
                return fault
            step += 1
            if step <= ramp_steps:
                write(policy.hold(sensors, first_angles + step / ramp_steps * (policy.home - first_angles)))
            else:
                write(policy.act(sensors, command()))
            deadline += period
            if time.perf_counter() > deadline + MAX_LATENESS * period:
                return f"a control step took longer than {(1.0 + MAX_LATENESS) * period:g} s"
            time.sleep(max(deadline - time.perf_counter(), 0.0))
        return ""
    finally:
        write(policy.relax(sensors))


def _join(names: list, parts: dict) -> np.ndarray:
    """Return parts [name, size] as one vector; those that sensors do not give are 0."""
    return np.concatenate([np.zeros(0), *(parts.get(name, np.zeros(size)) for name, size in names)])


def _yaw(quaternion: np.ndarray) -> float:
    w, x, y, z = quaternion
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def _turn(quaternion: np.ndarray, angle: float) -> np.ndarray:
    """Return an orientation turned about the vertical."""
    return _product(np.array((math.cos(0.5 * angle), 0.0, 0.0, math.sin(0.5 * angle))), quaternion)


def _product(second: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Return the rotation that applies one quaternion and then another."""
    vector = second[0] * first[1:] + first[0] * second[1:] + np.cross(second[1:], first[1:])
    return np.array((second[0] * first[0] - second[1:] @ first[1:], *vector))


def _matrix(quaternion: np.ndarray) -> np.ndarray:
    w, x, y, z = quaternion
    return np.array(
        (
            (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
            (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
            (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
        )
    )


def _about(axis: np.ndarray, angle: float) -> np.ndarray:
    """Return the rotation about a unit vector."""
    return _matrix(np.array((math.cos(0.5 * angle), *(math.sin(0.5 * angle) * axis))))


if __name__ == "__main__":
    for index, motor in enumerate(read_facts()["motors"]):
        texts = [
            f"{name} {value:.4g}" if isinstance(value, float) else f"{name} {value}" for name, value in motor.items()
        ]
        print(index, ", ".join(texts))
