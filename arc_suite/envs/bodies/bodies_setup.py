"""`BodiesSetup`: several bodies, a task and its settings as one value, for policies of any body."""

import dataclasses
import functools
import hashlib
import re
from collections.abc import Mapping
from typing import Any

from arc_suite import checks, registry, versions
from arc_suite.envs.bodies import BodiesEnv
from arc_suite.envs.bodies.flat_bodies import FlatBodies
from arc_suite.envs.setup import BaseSetup, Setup
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec import Body
from arc_suite.robots.spec_files import body_to_json
from arc_suite.tasks.contract import Task

_SEVERAL = re.compile(r",|:\d+-\d+$")
HELD_OUT = 100_000  # first seed of the bodies of a family that validate what others trained


@dataclasses.dataclass(frozen=True)
class BodiesSetup(BaseSetup):
    """Bodies in a task with settings, with what training needs of a `Setup`; make it by `BodiesSetup.of`.

    Joints take positions; see `envs.bodies`.

    Attributes:
        robot: bodies as programs take them: `family:first-last`, `family:seed` or names of robots, with commas.
        task: name of the task, `module:name` for one of another package.
        settings_json: JSON of the task's settings, keys in order.
    """

    robot: str
    task: str = "walk"
    settings_json: str = "{}"

    @classmethod
    def of(cls, robot: str, task_name: str = "walk", task_kwargs: Mapping[str, Any] | None = None) -> "BodiesSetup":
        """Return the setup of bodies; for the rest see `Setup.of`.

        Raises:
            ValueError: an unknown name, a setting that JSON cannot hold, or actions other than positions.
        """
        settings = checks.mapping("task_kwargs", task_kwargs)
        checks.name(settings.get("actions", "position"), ["position"], "actions of different bodies")
        found = cls(robot)
        one = Setup.of(found.bodies[0], task_name, settings)
        return cls(robot, one.task, one.settings_json)

    @functools.cached_property
    def bodies(self) -> tuple[Body, ...]:
        """All bodies, in order."""
        return tuple(body for part in self.robot.split(",") for body in registry.bodies_of(part))

    @property
    def name(self) -> str:
        """Name of the bodies in names of files."""
        return self.robot.replace(":", ".").replace(",", "+")

    @property
    def definition(self) -> Task:
        """The task of the first body, ready to run.

        Raises:
            ValueError: a setting that does not fit.
        """
        return self._of(self.bodies[0]).definition

    def members(self) -> tuple[Setup, ...]:
        """Return the setup of each body, with positions as actions."""
        return tuple(map(self._of, self.bodies))

    def _of(self, body: Body) -> Setup:
        return Setup.of(body, self.task, self.task_kwargs | {"actions": "position"})

    def validation(self, count: int) -> "BodiesSetup":
        """Return the setup of at most `count` bodies that evaluate a policy while it learns.

        Of families they are bodies of seeds from 100,000 on, else the first of the bodies themselves. A curriculum is
        left out, as in `Setup.validation`.
        """
        settings = self._judged_json()
        families = [family for part in self.robot.split(",") if (family := part.rpartition(":")[0])]
        if not families:
            return dataclasses.replace(self, settings_json=settings, robot=",".join(self.robot.split(",")[:count]))
        families = list(dict.fromkeys(families))[:count]
        each = count // len(families)
        ranges = (f"{family}:{HELD_OUT}-{HELD_OUT + each - 1}" for family in families)
        return dataclasses.replace(self, settings_json=settings, robot=",".join(ranges))

    def make_vec(self, num_envs: int = 1, *, seed: int | None = None, **options) -> FlatBodies:
        """Open environments; environment i has body i, and so on from the first after the last.

        Args:
            num_envs: number of environments, at least one for each body.
            seed: of the first environment's stream of episodes; the others count on. None for random ones.
            options: see `arc_suite.envs.bodies.BodiesEnv`.
        """
        bodies, settings = list(self.bodies), self._seeded(seed)
        return FlatBodies(BodiesEnv(self.task, num_envs, bodies, task_kwargs=settings, **options))

    def provenance(self) -> dict[str, Any]:
        """Return, JSON-able, `to_dict` with the task's version, a hash of all bodies, and versions of packages."""
        texts = hashlib.sha256()
        for body in self.bodies:
            texts.update(body_to_json(body).encode())
        known = {"task_version": self.kind.version, "body_sha256": texts.hexdigest(), "versions": versions.recorded()}
        return self.to_dict() | known

    def __str__(self) -> str:
        return self._named(self.robot)


def of_any(robot, task_name: str = "walk", task_kwargs: Mapping[str, Any] | None = None) -> "Setup | BodiesSetup":
    """Return the setup of one body, or of several that a text names; see `Setup.of` and `BodiesSetup.of`."""
    return (BodiesSetup if is_several(robot) else Setup).of(robot, task_name, task_kwargs)


def from_dict(fields: Mapping[str, Any]) -> "Setup | BodiesSetup":
    """Return the setup that a file holds, of one body or of several; see `Setup.from_dict`."""
    robot = fields.get("robot")
    if not is_several(robot):
        return Setup.from_dict(fields)
    for part in robot.split(","):
        registry.imported("robot", part.rpartition(":")[0] if ":" in part else part)
    one = Setup.from_dict({**fields, "robot": next(iter(ROBOTS))})  # checks the rest
    return BodiesSetup(robot, one.task, one.settings_json)


def is_several(robot) -> bool:
    """Return whether a text names several bodies: `family:first-last`, or names with commas."""
    return isinstance(robot, str) and not robot.startswith("{") and bool(_SEVERAL.search(robot))
