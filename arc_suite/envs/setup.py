"""`Setup`: a body or several, a task and its settings as one value, which opens environments and goes into files."""

import dataclasses
import functools
import hashlib
import json
from collections.abc import Iterable, Mapping
from typing import Any

import gymnasium
import mujoco
import numpy as np
from gymnasium.envs.registration import EnvSpec

from arc_suite import checks, registry, versions
from arc_suite.envs import dm
from arc_suite.envs.prepare import prepare_task
from arc_suite.envs.vector import VectorEnv
from arc_suite.robots import is_robot
from arc_suite.robots.spec import Body
from arc_suite.robots.spec_files import body_to_json
from arc_suite.tasks.contract import STEPS, Task

ATTRIBUTE = "arc_suite"  # of an observation space: the setup that an agent was trained in, as `Setup.to_dict`
HELD_OUT = 100_000  # first seed of the bodies of a family that validate what others trained


@dataclasses.dataclass(frozen=True)
class Setup:
    """A body or several in a task with settings; make it by `Setup.of`, which checks names.

    Equal setups have equal content, however their tasks and settings were written. Several bodies share one policy:
    joints take positions, and environments are those of `arc_suite.bodies`.

    Attributes:
        domain: the body, or the text that names several: `family:first-last`, or names with commas.
        task: name of the task, `module:name` for one of another package.
        settings_json: JSON of the task's settings, keys in order.
    """

    domain: Body | str
    task: str = "walk"
    settings_json: str = "{}"

    @classmethod
    def of(cls, domain_name, task_name: str = "walk", task_kwargs: Mapping[str, Any] | None = None) -> "Setup":
        """Return the setup of what `arc_suite.load` takes, or of several bodies; modules that names give are imported.

        Values of settings are checked where the task is prepared or an environment opened.

        Args:
            domain_name: a body, see `registry.body_of`, or a text that names several, see `registry.bodies_of`.
            task_name: see `registry.task_of`.
            task_kwargs: settings of the task that JSON can hold, without `random`.

        Raises:
            ValueError: an unknown name, a setting that JSON cannot hold, or actions of several bodies other than
                positions.
            OSError: a file that cannot be read.
        """
        made = cls._checked(domain_name, task_name, task_kwargs)
        _ = made.bodies  # finds out at once whether there are such bodies
        return made

    @classmethod
    def _checked(cls, domain_name, task_name: str, task_kwargs: Mapping[str, Any] | None) -> "Setup":
        several, settings = registry.names_several_bodies(domain_name), checks.mapping("task_kwargs", task_kwargs)
        domain, task = domain_name if several else registry.body_of(domain_name), registry.task_of(task_name)
        if "random" in settings:
            random = checks.preview(settings["random"])
            raise ValueError(f"setting 'random': expected none, as every episode has a seed, got {random}")
        if several:
            checks.name(settings.get("actions", "position"), ["position"], "actions of different bodies")
        named = {registry.importable_name("modifier", name): value for name, value in settings.items()}
        text = checks.json_text("task_kwargs", named)
        if isinstance(arena := settings.get("arena"), str):
            registry.arena_maker(arena)
        return cls(domain, registry.importable_name("task", task.name), text)

    @property
    def several(self) -> bool:
        """Whether the setup is of several bodies."""
        return isinstance(self.domain, str)

    @functools.cached_property
    def bodies(self) -> tuple[Body, ...]:
        """All bodies, in order."""
        return registry.bodies_of(self.domain)

    @property
    def body(self) -> Body:
        """The only body.

        Raises:
            ValueError: there are several.
        """
        return registry.body_of(self.domain)

    @property
    def robot(self) -> str:
        """The bodies as files name them.

        Name of the robot, with the module for one of another package; the JSON text of another body; the text that
        names several.
        """
        if isinstance(self.domain, str):
            return self.domain
        return (
            registry.importable_name("robot", self.domain.name) if is_robot(self.domain) else body_to_json(self.domain)
        )

    @property
    def name(self) -> str:
        """Name of the bodies in names of files."""
        return self._label.replace(":", ".").replace(",", "+")

    @property
    def _label(self) -> str:
        return self.domain if isinstance(self.domain, str) else self.domain.name

    @property
    def task_kwargs(self) -> dict[str, Any]:
        """Settings of the task, as `arc_suite.load` takes them; a new dictionary."""
        return json.loads(self.settings_json)

    @property
    def excluded_blocks(self) -> tuple[str, ...]:
        """Names of the blocks that the task leaves out of the observation."""
        names = self.task_kwargs.get("exclude_blocks", ())
        return (names,) if isinstance(names, str) else tuple(names)

    @property
    def kind(self) -> type[Task]:
        """Class of the task, with its name and version."""
        return registry.task_of(self.task)

    @property
    def env_id(self) -> str:
        """Gymnasium's id, `arc_suite/<robot>-<task>-v<version>`."""
        return registry.env_id(self.body.name, self.kind)

    @property
    def definition(self) -> Task:
        """The task, ready to run; of several bodies that of the first.

        Raises:
            ValueError: a setting that does not fit.
        """
        return self.prepare()[0]

    def prepare(self) -> tuple[Task, mujoco.MjModel]:
        """Return the task, ready to run, and the compiled model; of several bodies those of the first.

        Raises:
            ValueError: a setting that does not fit.
        """
        first = self.members()[0]
        return prepare_task(first.domain, first.task, first.task_kwargs)

    def members(self) -> tuple["Setup", ...]:
        """Return the setup of each body; of several bodies with positions as actions."""
        shared = self.with_settings({"actions": "position"} if self.several else {})
        return tuple(dataclasses.replace(shared, domain=body) for body in self.bodies)

    def with_settings(self, changes: Mapping[str, Any], dropped: Iterable[str] = ()) -> "Setup":
        """Return the setup with some settings changed, and without others.

        Raises:
            ValueError: a setting that JSON cannot hold.
        """
        kept = {name: value for name, value in self.task_kwargs.items() if name not in dropped}
        return Setup._checked(self.domain, self.task, kept | dict(changes))

    def validation(self, count: int) -> "Setup":
        """Return the setup that evaluates a policy while it learns.

        Several bodies of families become at most `count` of seeds from 100,000 on; others their first `count`.
        """
        return dataclasses.replace(self, domain=_held_out(self.domain, count)) if isinstance(self.domain, str) else self

    def judging(self) -> "Setup":
        """Return the setup that judges a policy of this one: with all blocks, as a policy leaves out the others."""
        return self.with_settings({}, dropped=["exclude_blocks"])

    def load(self, seed: int | None = None, **options) -> dm.Environment:
        """Open a dm_env.

        Args:
            seed: of the stream of episodes; None for a random one.
            options: see `arc_suite.load`.
        """
        return dm.load(self.body, self.task, self._seeded(seed), **options)

    def make(self, **options) -> gymnasium.Env:
        """Open a Gymnasium environment; for the options see `gymnasium.make`."""
        return gymnasium.make(self.spec(), **options)

    def make_vec(self, num_envs: int = 1, *, seed: int | None = None, **options) -> Any:
        """Open a `VectorEnv`; of several bodies a `BodiesEnv` with flat observations.

        Args:
            num_envs: number of environments; environment i has body i, and so on from the first after the last.
            seed: of the first environment's stream of episodes; the others count on. None for random ones.
            options: see `arc_suite.envs.vector.VectorEnv`.
        """
        options["task_kwargs"] = self._seeded(seed)
        if self.several:
            return registry.resolve(registry.BODIES_ENV)(self.task, num_envs, self.bodies, flat=True, **options)
        return VectorEnv(self.domain, self.task, num_envs, **options)

    def spec(self, max_episode_steps: int = STEPS) -> EnvSpec:
        """Return the spec by which Gymnasium makes the environment anew, in another process too."""
        kwargs = {"domain_name": self.robot, "task_name": self.task}
        return EnvSpec(
            id=self.env_id,
            entry_point="arc_suite.envs.gym:Env",
            vector_entry_point="arc_suite.envs.vector:VectorEnv",
            max_episode_steps=max_episode_steps,
            kwargs=kwargs | ({"task_kwargs": self.task_kwargs} if self.task_kwargs else {}),
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the setup as files hold it, JSON-able: `robot`, `task`, `task_kwargs`."""
        return {"robot": self.robot, "task": self.task, "task_kwargs": self.task_kwargs}

    @classmethod
    def from_dict(cls, fields: Mapping[str, Any]) -> "Setup":
        """Return the setup that a file holds; nothing is imported, and no file opened.

        Args:
            fields: those of `to_dict`, of any values; others are ignored.

        Raises:
            ValueError: a field is missing, of another type, an unknown name, or a name whose module has not been
                imported.
        """
        for name, kind in (("robot", str), ("task", str), ("task_kwargs", dict)):
            if not isinstance(fields.get(name), kind):
                raise ValueError(f"expected {name} to be a {kind.__name__}, got {checks.preview(fields.get(name))}")
        robot, task, settings = registry.check_stored_robot(fields["robot"]), fields["task"], fields["task_kwargs"]
        registry.refuse_import("task", task)
        registry.check_stored_settings(settings)
        return cls._checked(robot, task, settings)  # draws no body of several

    def provenance(self) -> dict[str, Any]:
        """Return, JSON-able, `to_dict` with the task's version, and hashes and versions of all that computes.

        Several bodies have no hash of a model.

        Raises:
            ValueError: a setting that does not fit.
        """
        texts = "".join(map(body_to_json, self.bodies))
        known = self.to_dict() | {"task_version": self.kind.version, "body_sha256": _sha256(texts.encode())}
        if not self.several:
            model = self.prepare()[1]
            buffer = np.zeros(mujoco.mj_sizeModel(model), np.uint8)
            mujoco.mj_saveModel(model, None, buffer)
            known["model_sha256"] = _sha256(buffer.data)
        return known | {"versions": versions.dependency_versions()}

    def _seeded(self, seed: int | None) -> dict[str, Any]:
        return self.task_kwargs | ({} if seed is None else {"random": seed})

    def __str__(self) -> str:
        settings = "" if self.settings_json == "{}" else f", {self.settings_json}"
        return f"{self._label}, {self.kind.name}{settings}"


def _sha256(content) -> str:
    return hashlib.sha256(content).hexdigest()


def _held_out(robot: str, count: int) -> str:
    """Text of at most `count` bodies that validate what several learned with."""
    parts = robot.split(",")
    families = list(dict.fromkeys(family for part in parts if (family := part.rpartition(":")[0])))[:count]
    if not families:
        return ",".join(parts[:count])
    each = count // len(families)
    return ",".join(f"{family}:{HELD_OUT}-{HELD_OUT + each - 1}" for family in families)
