"""Tasks with modifiers: any task, disturbed, or with other motors or senses.

A modified task wraps another, which may come from another package: it changes actions and observations,
adds kicks, and changes fields of the model. Its memory holds that of the other.
"""

import dataclasses
import functools
import math
from collections.abc import Hashable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.markers import Marker
from arc_suite.models.sizing import position_gains, reaches, sized
from arc_suite.models.standing import GRAVITY, standing
from arc_suite.robots import mirror
from arc_suite.tasks import noise, overruled, privileged, randomization
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.contract import Inputs, Start, Task
from arc_suite.tasks.mirrors import Symmetry
from arc_suite.tasks.modifiers import FAILS_FROM, Modifiers, blocks_of_history, checked
from arc_suite.tasks.parts import Joints, Repeated
from arc_suite.tasks.randomization import LONGEST, SCHEDULE, SHORTEST, Hidden, Pushes
from arc_suite.tasks.readings import Readings
from arc_suite.tasks.wrapper import Wrapper

# How pictures show a kick or a push: for how many control steps a kick, in which color; length by sqrt(g h) or by the
# weight, radius of the shaft, and distance from the torso's solids, which shells exceed, h.
SHOWN, _KICKED, _LENGTH, _SHAFT, _APART = 10, (0.95, 0.1, 0.08, 1.0), 1.0, 0.07, 0.3


class Changes(NamedTuple):
    """Memory of the modifiers.

    Attributes:
        elapsed: (..., 1) uint32, control steps since the start.
        terminated: (...) whether the latest step has ended the episode in failure.
        kick_steps: (..., SCHEDULE) control steps, counted from 1, before which kicks come.
        kicks: (..., SCHEDULE, 2) changes of the torso's velocity in the world, m/s.
        strength: (..., joints) of the motors, a share.
        failing: (..., joints) whether they are those of the leg whose motors fail.
        noise_key: (..., 1) uint32, from which the noise of the episode follows.
        delay: (...) of actions, control steps.
        waiting: (..., longest delay, joints) the latest actions, the newest first.
        angles: (..., joints) of the joints at the latest reading, rad.
        speeds: (..., joints) of the joints at the latest reading, rad/s.
        hidden: what the episode has drawn of the body.
        pushes: forces on the torso.
        now: (..., size) the latest observation of the blocks of a history; empty for none.
        recent: (..., history, size + joints) earlier ones and the actions after them, the newest first.
    """

    elapsed: np.ndarray
    terminated: np.ndarray
    kick_steps: np.ndarray
    kicks: np.ndarray
    strength: np.ndarray
    failing: np.ndarray
    noise_key: np.ndarray
    delay: np.ndarray
    waiting: np.ndarray
    angles: np.ndarray
    speeds: np.ndarray
    hidden: Hidden
    pushes: Pushes
    now: np.ndarray
    recent: np.ndarray


class ModifiedMemory(NamedTuple):
    """Memory of a modified task.

    Attributes:
        task: memory of the task that it wraps.
        changes: memory of the modifiers.
    """

    task: Any
    changes: Changes


class Draws(NamedTuple):
    """What is random in the modifiers of one episode, in the order in which it is drawn; all is, always.

    Attributes:
        kick_steps: (SCHEDULE,) control steps before which kicks come, each 40 to 120 after the one before.
        kick_sizes: (SCHEDULE,) uniform in [0, 1).
        kick_directions: (SCHEDULE,) rad, uniform in [0, 2 pi).
        leg: index of one.
        strength: position of the motors' strength in its range, uniform in [0, 1).
        friction: position of the friction in its range, uniform in [0, 1).
        mass: position of the mass in its range, uniform in [0, 1).
        delay: position of the delay in its range, uniform in [0, 1).
        noise_key: an integer of 32 bits.
    """

    kick_steps: np.ndarray
    kick_sizes: np.ndarray
    kick_directions: np.ndarray
    leg: int
    strength: float
    friction: float
    mass: float
    delay: float
    noise_key: int


def draw(random: np.random.RandomState, legs: int) -> Draws:
    """Draw the modifiers of an episode of a body with a number of legs."""
    return Draws(
        random.randint(SHORTEST, LONGEST, SCHEDULE).cumsum(),
        random.uniform(size=SCHEDULE),
        random.uniform(0.0, 2.0 * math.pi, SCHEDULE),
        random.randint(legs),
        *random.uniform(size=4),
        random.randint(2**32, dtype=np.uint32),
    )


def modified(task: Task, settings: Mapping[str, Any]) -> Task:
    """Return a task with modifiers.

    Args:
        task: any.
        settings: some of the fields of `modifiers.Modifiers` by name.

    Raises:
        ValueError: an unknown name, or a value that does not fit.
    """
    # A task by registration, which type checkers do not see.
    return Modified(task, checked(settings, task.scene.body, task.blocks))  # type: ignore[return-value]


@dataclasses.dataclass(frozen=True, eq=False)
class Modified(Wrapper):
    """A task with modifiers.

    Attributes:
        changes: what is changed of it.
    """

    from_body = ("gains", "reach", "noises", "weight")

    changes: Modifiers

    @property
    def structure(self) -> Hashable:
        """Which modifiers there are, and the shape of their memory."""
        own = self.changes
        switches = own.kicks > 0.0, own.delay[1], own.actuator_failure is False, own.actions, own.exclude_blocks
        return (*switches, own.force > 0.0, own.joint_offset > 0.0, own.history, *self.noises)

    @property
    def actions(self) -> str:
        """What an action asks of a motor."""
        return self.changes.actions

    @functools.cached_property
    def symmetry(self) -> Symmetry:
        """The mirror maps of observations and actions; what is drawn is as likely on either side.

        Raises:
            ValueError: a leg of one side fails in every episode, or as the other task.
        """
        leg = self.changes.actuator_failure
        if not isinstance(leg, bool) and mirror.image(self.scene.body).legs[leg] != leg:
            raise ValueError(f"actuator_failure: expected a leg that is drawn, or one on the midline, got {leg}")
        return super().symmetry

    @property
    def blocks(self) -> Mapping[str, Block]:
        """The other task's blocks without the excluded ones, and the history of some."""
        kept = {name: block for name, block in self.task.blocks.items() if name not in self.changes.exclude_blocks}
        if not self.changes.history:
            return kept
        parts = [part for block in self._remembered.values() for part in block.parts]
        step = (*parts, Joints(self.scene.body, "action of {}"))
        return {**kept, "history": Block((Repeated(step, self.changes.history),))}

    @functools.cached_property
    def _remembered(self) -> dict[str, Block]:
        """The blocks that a history keeps, by name."""
        return blocks_of_history(self.task.blocks, self.changes.exclude_blocks)

    @functools.cached_property
    def members(self) -> np.ndarray:
        """(legs, joints) which joints are those of a leg."""
        owners = np.repeat(np.arange(len(self.scene.body.legs)), [len(leg.joints) for leg in self.scene.body.legs])
        return owners == np.arange(len(self.scene.body.legs))[:, None]

    @functools.cached_property
    def gains(self) -> tuple[np.ndarray, np.ndarray]:
        """The stiffness (joints,), action per rad, and damping, action per rad/s, with which positions are held."""
        body = sized(self.scene.body)
        return position_gains(body, standing(body).inertias)

    @functools.cached_property
    def reach(self) -> np.ndarray:
        """(joints,) the farther limit of each joint's range, from the standing pose, rad."""
        return reaches(self.scene.body)

    @functools.cached_property
    def noises(self) -> dict[str, tuple[slice, np.ndarray]]:
        """Where the noise of a block lies among that of all blocks, and its half-widths (size,), by name."""
        levels, last, noises = self.changes.observation_noise, 0, {}
        for name, block in self.task.blocks.items():
            if block.noise is not None:
                first, last = last, last + block.size
                if levels.get(name) and name not in self.changes.exclude_blocks:
                    noises[name] = slice(first, last), levels[name] * block.widths
        return noises

    def start(self, random: np.random.RandomState, stream: Any) -> Start:
        """Draw the other task's start, then what is random in the modifiers; see `Draws` and `randomization.Draws`."""
        start, body, changes = self.task.start(random, stream), self.scene.body, self.changes
        drawn = draw(random, len(body.legs))
        joints = len(body.joint_names)
        later = randomization.draw(drawn.noise_key, joints)
        size = sum(block.size for block in self._remembered.values()) * (changes.history > 0)
        directions = np.stack([np.cos(drawn.kick_directions), np.sin(drawn.kick_directions)], axis=-1)
        unit = changes.kicks * math.sqrt(GRAVITY * body.torso.standing_height)
        low, high = changes.delay
        leg = drawn.leg if changes.actuator_failure is True else changes.actuator_failure
        hidden = randomization.hidden(changes, body, drawn.strength, drawn.friction, drawn.mass, later)
        own = Changes(
            elapsed=np.zeros(1, np.uint32),
            terminated=np.False_,
            kick_steps=drawn.kick_steps,
            kicks=unit * drawn.kick_sizes[:, None] * directions,
            strength=hidden.motor_strength * hidden.joint_strength,
            failing=np.zeros(joints, bool) if changes.actuator_failure is False else self.members[leg],
            noise_key=np.array([drawn.noise_key], np.uint32),
            delay=low + int(drawn.delay * (high - low + 1)),
            waiting=np.zeros((high, joints)),
            angles=np.zeros(joints),
            speeds=np.zeros(joints),
            hidden=hidden,
            pushes=randomization.pushes(changes.force * self.weight, later),
            now=np.zeros(size),
            recent=np.zeros((changes.history, size + joints)),
        )
        model = randomization.changed_model(self.scene, changes, hidden, start.model)
        return start._replace(memory=ModifiedMemory(start.memory, own), model=model)

    @functools.cached_property
    def weight(self) -> float:
        """The weight of the body without a load, N."""
        return GRAVITY * standing(self.scene.body).mass

    def begin(self, memory: ModifiedMemory, readings: Readings) -> ModifiedMemory:
        """Return the other task's memory, the state of the joints, and a history that repeats the start."""
        begun = ModifiedMemory(self.task.begin(memory.task, readings), self._sensed(memory.changes, readings))
        begun = self._observed(begun, readings)
        if not self.changes.history:
            return begun
        own = begun.changes
        numpy, recent = own.recent.__array_namespace__(), own.recent[..., : own.now.shape[-1]]
        held = numpy.broadcast_to(own.now[..., None, :], recent.shape)
        recent = numpy.concatenate([held, 0.0 * own.recent[..., own.now.shape[-1] :]], axis=-1)
        return begun._replace(changes=own._replace(recent=recent))

    def before(self, memory: ModifiedMemory, action) -> tuple[ModifiedMemory, Inputs]:
        """Return the memory, and what the other task writes as motors and kicks change it.

        The other task is given, and its reward judges, the torques commanded of the motors when they
        arrive; weak and failing motors give less.
        """
        changes, own = self.changes, memory.changes
        if changes.history:
            own = _remembered(own, action)
        if changes.delay[1]:
            own, action = _delayed(own, action)
        if self._controls:
            action = self.torques(own, action)
        inner, inputs = self.task.before(memory.task, action)
        wanted, strength = inputs.ctrl, own.strength
        if self.scene.body.source and changes.joint_offset:
            wanted = wanted - own.hidden.joint_offset / self.reach  # of servos, whose sensors have the offset
        ctrl = strength * wanted
        if changes.actuator_failure is not False:
            works = ~(own.failing & (own.elapsed >= FAILS_FROM))
            ctrl, strength = ctrl * works, strength * works
        if self.scene.body.source:
            numpy = ctrl.__array_namespace__()
            ctrl = numpy.concatenate([ctrl, 1.0 - strength], axis=-1)  # of servos and of their releases
        kick = self._kick(own, inputs.kick) if changes.kicks else inputs.kick
        force = self._force(own, inputs.force) if changes.force else inputs.force
        return ModifiedMemory(inner, own._replace(elapsed=own.elapsed + np.uint32(1))), Inputs(ctrl, kick, force)

    @property
    def _controls(self) -> bool:
        """Whether it holds positions by torques; servos do so by themselves."""
        return self.changes.actions == "position" and not self.scene.body.source

    def torques(self, changes: Changes, action):
        """Return the actions (..., joints) in [-1, 1] of motors that hold joints at the positions of an action."""
        stiffness, damping = self.gains
        stiff, damped = changes.hidden.gains[..., :1], changes.hidden.gains[..., 1:]
        pull = stiff * (stiffness * (self.reach * action - changes.angles))
        return (pull - damped * (damping * changes.speeds)).clip(-1.0, 1.0)

    def positions(self, torques, angles, speeds):
        """Return the action (..., joints) for which motors that hold positions give torques, as far as joints reach.

        Args:
            torques: (..., joints) in [-1, 1].
            angles: (..., joints) of the joints, rad.
            speeds: (..., joints) of the joints, rad/s.
        """
        stiffness, damping = self.gains
        return ((angles + (torques + damping * speeds) / stiffness) / self.reach).clip(-1.0, 1.0)

    def after(self, memory: ModifiedMemory, readings: Readings) -> ModifiedMemory:
        """Return the other task's memory, the state of the joints, and whether the body has fallen."""
        inner, own = self.task.after(memory.task, readings), self._sensed(memory.changes, readings)
        terminated, _ = self.task.ended(inner, readings)
        # With the leading axes of the memory, even where the task returns one boolean for all environments.
        memory = ModifiedMemory(inner, own._replace(terminated=(own.terminated & False) | terminated))
        return self._observed(memory, readings)

    def observe(self, memory: ModifiedMemory, readings: Readings) -> dict:
        """Return the other task's blocks with offsets of sensors and noise, without those that are left out."""
        blocks, own = self._sensed_blocks(memory, readings), memory.changes
        if self.changes.history:
            blocks["history"] = own.recent.reshape(*own.recent.shape[:-2], -1)
        return blocks

    def _observed(self, memory: ModifiedMemory, readings: Readings) -> ModifiedMemory:
        """The memory with what a history takes of the present."""
        if not self.changes.history:
            return memory
        found = self._sensed_blocks(memory, readings)
        blocks = [found[name] for name in self._remembered]
        now = blocks[0].__array_namespace__().concatenate(blocks, axis=-1)
        return memory._replace(changes=memory.changes._replace(now=now))

    def _sensed_blocks(self, memory: ModifiedMemory, readings: Readings) -> dict:
        """The other task's blocks as sensors give them."""
        own = memory.changes
        observed = self.task.observe(memory.task, self._displaced(own, readings))
        blocks = {name: observed[name] for name in observed if name not in self.changes.exclude_blocks}
        if self.noises:
            count = max(part.stop for part, _ in self.noises.values())
            drawn = noise.noise(own.noise_key, own.elapsed, count)
            blocks |= {name: blocks[name] + widths * drawn[..., part] for name, (part, widths) in self.noises.items()}
        return blocks

    @property
    def privileged_blocks(self) -> Mapping[str, Block]:
        """The other task's, and those of what modifiers change."""
        return {**self.task.privileged_blocks, **privileged.blocks_of_modifiers(self.scene.body)}

    def privileged(self, memory: ModifiedMemory, data) -> dict:
        """Return the other task's blocks, and those of what modifiers change; see `privileged.blocks_of_modifiers`."""
        own, hidden, height = memory.changes, memory.changes.hidden, self.scene.standing[..., 2:3]
        numpy, heading = own.kicks.__array_namespace__(), rotations.yaw(data.qpos[..., 3:7])
        fails = own.failing & (own.elapsed > FAILS_FROM)
        begun = own.elapsed > 0
        kick = self._due(own, own.elapsed - begun) * begun / (GRAVITY * height) ** 0.5
        force = own.pushes.acting(own.elapsed) * begun / numpy.asarray(self.weight)[..., None]
        return {
            **self.task.privileged(memory.task, data),
            **{name: values for name, values in hidden._asdict().items() if not name.endswith("_strength")},
            "strength": own.strength * ~fails,
            "kick": rotations.headed(kick, heading),
            "force": rotations.headed(force, heading),
        }

    def overruled(self, blocks: Mapping[str, Any], fields: Mapping[str, Any]) -> dict:
        """Return the privileged blocks that changed fields of the model decide; see `overruled.told`."""
        return {**self.task.overruled(blocks, fields), **overruled.told(self.scene, blocks, fields)}

    def progress(self, memory: ModifiedMemory) -> dict:
        """Return the other task's metrics, and whether the body `fell`, 0 or 1."""
        metrics = self.task.progress(memory.task)
        return metrics if "fell" in metrics else metrics | {"fell": memory.changes.terminated * 1.0}

    def markers(self, memory: ModifiedMemory, readings: Readings) -> list[Marker]:
        """Return the other task's, and a red arrow against the torso: for `SHOWN` steps for a kick, and for a push."""
        return [*self.task.markers(memory.task, readings), *self._shown(memory.changes, readings)]

    def _shown(self, changes: Changes, readings: Readings) -> Iterator[Marker]:
        height, elapsed = self.scene.body.torso.standing_height, int(changes.elapsed[0])
        since = elapsed - changes.kick_steps
        shown = (since >= 0) & (since % changes.kick_steps[-1] < SHOWN)
        pushes = [changes.pushes.acting(elapsed) / self.weight] if elapsed else []
        for push in (*changes.kicks[shown] / math.sqrt(GRAVITY * height), *pushes):
            size = math.hypot(*push)
            if size > 0.0:
                way = np.array((*push / size, 0.0))
                tip = readings.torso_position - self._rim * way
                yield Marker("arrow", tip - _LENGTH * height * size * way, tip, _SHAFT * height, _KICKED)

    @functools.cached_property
    def _rim(self) -> float:
        """The distance from the torso's middle at which arrows of kicks end, m."""
        torso = self.scene.body.torso
        reach = max(math.hypot(*solid.position[:2]) + max(solid.size) for solid in torso.solids)
        return reach + _APART * torso.standing_height

    def failed_legs(self, memory: ModifiedMemory) -> tuple[str, ...]:
        """Return the leg whose motors have failed, once they have."""
        own, legs = memory.changes, self.scene.body.legs
        if own.elapsed[0] <= FAILS_FROM:
            return ()
        return tuple(leg.name for leg, joints in zip(legs, self.members, strict=True) if own.failing[joints].any())

    def _sensed(self, changes: Changes, readings: Readings) -> Changes:
        if not self._controls:
            return changes
        angles = self._displaced(changes, readings).joint_angles + 0.0
        return changes._replace(angles=angles, speeds=readings.velocities[..., 6:] + 0.0)

    def _displaced(self, changes: Changes, readings: Readings) -> Readings:
        """The readings as sensors of joints show them, whose zeros are displaced."""
        if not self.changes.joint_offset:
            return readings
        numpy, angles = readings.posture.__array_namespace__(), readings.joint_angles + changes.hidden.joint_offset
        posture = numpy.concatenate([readings.posture[..., :5], angles], axis=-1)
        return readings._replace(posture=posture, joint_angles=angles)

    @staticmethod
    def _due(changes: Changes, elapsed):
        """The change of velocity (..., 2) by a kick in the step after others (..., 1)."""
        due = elapsed % changes.kick_steps[..., -1:] + 1 == changes.kick_steps
        return (due[..., None] * changes.kicks).sum(axis=-2)

    def _force(self, changes: Changes, force):
        """The force (..., 3) on the torso in a step, N."""
        numpy, push = changes.kicks.__array_namespace__(), changes.pushes.acting(changes.elapsed + np.uint32(1))
        push = numpy.concatenate([push, 0.0 * push[..., :1]], axis=-1)
        return push if force is None else force + push

    def _kick(self, changes: Changes, kick):
        """The kick (..., nv) of a step; a schedule that has run out begins again."""
        numpy, push = changes.kicks.__array_namespace__(), self._due(changes, changes.elapsed)
        rest = numpy.zeros((*push.shape[:-1], self.scene.standing.shape[-1] - 3))
        push = numpy.concatenate([push, rest], axis=-1)
        return push if kick is None else kick + push


def _remembered(changes: Changes, action) -> Changes:
    """The memory with an observation and the action after it as the newest."""
    numpy = changes.recent.__array_namespace__()
    newest = numpy.concatenate([changes.now, action], axis=-1)[..., None, :]
    return changes._replace(recent=numpy.concatenate([newest, changes.recent[..., :-1, :]], axis=-2))


def _delayed(changes: Changes, action):
    """The memory, with an action among those that wait, and the one that arrives (..., joints)."""
    numpy = action.__array_namespace__()
    under_way = numpy.concatenate([action[..., None, :], changes.waiting], axis=-2)
    delay = numpy.asarray(changes.delay)[..., None, None]
    arrived = numpy.take_along_axis(under_way, delay, axis=-2)[..., 0, :]
    return changes._replace(waiting=under_way[..., :-1, :]), arrived
