"""Walk: forward at the target speed, in the prescribed gait, for 50 seconds (the paper's Section 4)."""

import functools
from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple, TypeVar

import numpy as np

from arc_suite import checks
from arc_suite.robots.spec import Body
from arc_suite.tasks import blocks, clock, energy, parameters, terms
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.contract import Inputs, Start
from arc_suite.tasks.gait_task import GaitTask
from arc_suite.tasks.parameters import Noise, Parameters
from arc_suite.tasks.readings import Readings, component


class WalkSettings(NamedTuple):
    """Settings of a walk.

    Attributes:
        parameters: parameters of the gait, and the target velocity.
        velocity_band: half-width of the triangular kernel of the velocity, m/s.
        healthy_range: lowest and highest torso height, m.
        weights: signed weight of every term.
        noise: noise of the start.
    """

    parameters: Parameters
    velocity_band: float
    healthy_range: tuple[float, float]
    weights: dict[str, float]
    noise: Noise


class WalkMemory(NamedTuple):
    """Memory of an episode.

    Attributes:
        tick: (...) control steps since the start.
        action: (..., joints) action of the latest step, clipped to [-1, 1].
        previous_action: (..., joints) action of the step before; 0 before the first.
        x: (...) x of the torso's frame in the world at the latest reading, m.
        forward_velocity: (...) mean of the torso's world x velocity over the latest step, m/s.
        schedule_errors: (...) number of contact schedule errors in the latest step.
        distance: (...) along world x since the start, m.
        all_schedule_errors: (...) sum of `schedule_errors` over the steps.
        healthy: (...) whether the torso is in its healthy range of heights.
        energy: the motors' work by weight, m, from which the cost of transport follows.
    """

    tick: int | np.ndarray
    action: np.ndarray
    previous_action: np.ndarray
    x: np.ndarray
    forward_velocity: np.ndarray
    schedule_errors: np.ndarray
    distance: np.ndarray
    all_schedule_errors: np.ndarray
    healthy: np.ndarray
    energy: energy.Energy


_Memory = TypeVar("_Memory", bound=WalkMemory)  # a task that extends walk may remember more


class Walk(GaitTask):
    """Walking forward at the target speed in the prescribed gait."""

    name = "walk"
    # Attributes that follow from the body; see `Task.from_body`.
    from_body = ("clock", "clearances", "_torques", "_heat")
    # Section 4 of the paper. Each robot replaces "control" by a weight of its own.
    weights: ClassVar[dict[str, float]] = {
        "forward": 1.5,
        "healthy": 1.0,
        "gait_bonus": 1.5,
        "gait_cost": -0.1,
        "control": -0.05,
        "smoothness": -0.02,
        "contact": -0.0005,
        "angular_velocity": -0.05,
        "vertical_velocity": -0.02,
        "posture": -0.001,
    }

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """Return the names of the settings."""
        return (*parameters.NAMES, "velocity_band", "healthy_range")

    @classmethod
    def settings_for(cls, body: Body, overrides: Mapping[str, Any]) -> WalkSettings:
        """Return the settings for a body, some of them overridden; see `parameters.values`."""
        # `arena` is a setting of every task, which is read elsewhere; an error may propose it.
        values = parameters.values(body, overrides, cls.name, cls.names(), names_of_others=("arena",))
        return WalkSettings(
            parameters=parameters.parameters(body, values),
            velocity_band=parameters.positive("velocity_band", values["velocity_band"]),
            healthy_range=_healthy_range(values["healthy_range"]),
            weights=parameters.weights(cls.weights, values["weights"], overrides.get("weights")),
            noise=parameters.noise(values),
        )

    @functools.cached_property
    def blocks(self) -> Mapping[str, Block]:
        """The paper's observation (Section 3)."""
        return blocks.of_gait(self.scene.body, self.parameters.phase_offsets, self.parameters.default_angles)

    @property
    def target_velocity(self) -> float:
        """The target velocity, m/s."""
        return self.parameters.target_velocity

    def phase(self, memory: WalkMemory):
        """Return the phase (...) of the gait, rad."""
        return self.clock.entries(self.clock.phases, memory.tick)  # the clock has a table with a row for each tick

    def start(self, random: np.random.RandomState, stream: Any) -> Start:
        """Draw the state: the standing pose with noise. The clock starts at tick 0, which is phase 0."""
        qpos, qvel = self.settings.noise.draw(self.scene.standing, random)
        joints = len(self.scene.body.joint_names)
        no_action = np.zeros(joints)
        zero = np.float64(0.0)
        memory = WalkMemory(
            tick=0,
            action=no_action,
            previous_action=no_action,
            x=zero,
            forward_velocity=zero,
            schedule_errors=zero,
            distance=zero,
            all_schedule_errors=zero,
            healthy=np.True_,
            energy=energy.start(joints),
        )
        return Start(qpos, qvel, memory)

    def begin(self, memory: WalkMemory, readings: Readings) -> WalkMemory:
        """Return the memory with the torso's x."""
        x = component(readings.frame_position, 0) + 0.0  # a copy, as readings are views of the simulation
        return memory._replace(x=x, energy=energy.begin(memory.energy, readings.joint_angles))

    def before(self, memory: WalkMemory, action) -> tuple[WalkMemory, Inputs]:
        """Return the memory with the action, and the action itself as what to write."""
        return memory._replace(action=action, previous_action=memory.action), Inputs(action)

    def after(self, memory: _Memory, readings: Readings) -> _Memory:
        """Advance the clock, and measure the step's displacement and contact schedule errors."""
        tick = memory.tick + 1
        x = component(readings.frame_position, 0) + 0.0  # a copy
        stance = self.clock.entries(self.clock.stance, tick)
        schedule_errors = clock.schedule_errors(readings.foot_heights, self.parameters.stance_threshold, stance)
        displacement = x - memory.x
        low, high = self.settings.healthy_range
        height = readings.torso_height
        return memory._replace(
            tick=tick,
            x=x,
            forward_velocity=displacement / self.scene.control_timestep,
            schedule_errors=schedule_errors,
            distance=memory.distance + displacement,
            all_schedule_errors=memory.all_schedule_errors + schedule_errors,
            healthy=(low <= height) & (height <= high),
            energy=self.add_work(memory.energy, memory.action, readings),
        )

    def terms(self, memory: WalkMemory, readings: Readings) -> dict:
        """Return the paper's ten terms."""
        gait = self.parameters
        # The seven terms with a negative weight.
        costs = terms.costs(
            readings, memory.action, memory.previous_action, memory.schedule_errors, gait.default_angles
        )
        return {
            "forward": terms.triangle(memory.forward_velocity - gait.target_velocity, self.settings.velocity_band),
            "healthy": memory.healthy.astype(float),
            "gait_bonus": 1.0 - memory.schedule_errors / gait.feet,
            **costs,
        }

    def observe(self, memory: WalkMemory, readings: Readings) -> dict:
        """Return the paper's observation."""
        return {
            "posture": readings.posture,
            "velocities": readings.velocities,
            "contact_forces": readings.contact_forces,
            "gait_clock": self.clock.entries(self.clock.circle, memory.tick),
        }

    def ended(self, memory: WalkMemory, readings: Readings) -> tuple:
        """Return whether the torso has left its healthy range, which terminates, or the ground, which truncates."""
        position = readings.torso_position
        return ~memory.healthy, self.scene.arena.has_left(position[..., 0], position[..., 1])

    def progress(self, memory: WalkMemory) -> dict:
        """Return the mean `speed`, m/s, `gait_compliance`, the share of feet as prescribed, and `cost_of_transport`."""
        steps = memory.tick + (memory.tick == 0)  # at least 1
        time = steps * self.scene.control_timestep
        target_path = abs(self.target_velocity) * time  # m, that the body would have gone at the target velocity
        return {
            "speed": memory.distance / time,
            "gait_compliance": clock.compliance(memory.all_schedule_errors, steps, self.parameters.feet),
            "cost_of_transport": energy.cost_of_transport(memory.energy, abs(memory.distance), target_path),
        }


def _healthy_range(value: Any) -> tuple[float, float]:
    low, high = checks.array("healthy_range", value, 2)
    if not low < high:
        raise ValueError(f"healthy_range: expected low < high, got {checks.preview(value)}")
    return float(low), float(high)
