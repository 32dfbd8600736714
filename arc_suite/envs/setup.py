"""`Setup`: a body, a task and its settings as one value, which opens environments and goes into files."""

import dataclasses
import hashlib
import json
from collections.abc import Mapping
from typing import Any

import gymnasium
import mujoco
import numpy as np
from gymnasium.envs.registration import EnvSpec

from arc_suite import checks, registry, versions
from arc_suite.envs import dm
from arc_suite.envs.prepare import prepared
from arc_suite.envs.vector import VectorEnv
from arc_suite.robots import ROBOTS, is_robot
from arc_suite.robots.spec import Body
from arc_suite.robots.spec_files import body_from_json, body_to_json
from arc_suite.tasks.contract import CURRICULUM, STEPS, Task

ATTRIBUTE = "arc_suite"  # of an observation space: the setup that an agent was trained in, as `Setup.to_dict`


class BaseSetup:
    """What the setups of one body and of several have in common: a task with settings.

    Attributes:
        robot: body, or bodies, as programs take them.
        task: name of the task, `module:name` for one of another package.
        settings_json: JSON of the task's settings, keys in order.
    """

    robot: str
    task: str
    settings_json: str

    @property
    def task_kwargs(self) -> dict[str, Any]:
        """Settings of the task, as `arc_suite.load` takes them; a new dictionary."""
        return json.loads(self.settings_json)

    @property
    def kind(self) -> type[Task]:
        """Class of the task, with its name and version."""
        return registry.task_of(self.task)

    def to_dict(self) -> dict[str, Any]:
        """Return the setup as files hold it, JSON-able: `robot`, `task`, `task_kwargs`."""
        return {"robot": self.robot, "task": self.task, "task_kwargs": self.task_kwargs}

    def _judged_json(self) -> str:
        """JSON of the settings with which a policy is evaluated while it learns: those without a curriculum."""
        settings = self.task_kwargs
        kept = {name: value for name, value in settings.items() if name not in CURRICULUM}
        return checks.json_text("task_kwargs", kept if settings.get(CURRICULUM[0]) else settings)

    def _seeded(self, seed: int | None) -> dict[str, Any]:
        return self.task_kwargs | ({} if seed is None else {"random": seed})

    def _named(self, moving: str) -> str:
        """The setup as one line, for the name of what moves."""
        return f"{moving}, {self.kind.name}" + (f", {self.settings_json}" if self.settings_json != "{}" else "")


@dataclasses.dataclass(frozen=True)
class Setup(BaseSetup):
    """A body in a task with settings; make it by `Setup.of`, which checks names.

    Equal setups have equal content, however their tasks and settings were written.

    Attributes:
        body: the body that moves.
        task: name of the task, `module:name` for one of another package.
        settings_json: JSON of the task's settings, keys in order.
    """

    body: Body
    task: str = "walk"
    settings_json: str = "{}"

    @classmethod
    def of(cls, domain_name, task_name: str = "walk", task_kwargs: Mapping[str, Any] | None = None) -> "Setup":
        """Return the setup of what `arc_suite.load` takes; the modules that names give are imported.

        Values of settings are checked where the task is prepared or an environment opened.

        Args:
            domain_name: a body; see `registry.body_of`.
            task_name: see `registry.task_of`.
            task_kwargs: settings of the task that JSON can hold, without `random`.

        Raises:
            ValueError: an unknown name, or a setting that JSON cannot hold.
            OSError: a file that cannot be read.
        """
        body, task = registry.body_of(domain_name), registry.task_of(task_name)
        settings = checks.mapping("task_kwargs", task_kwargs)
        if "random" in settings:
            raise ValueError(
                f"setting 'random': expected none, as every episode has a seed, got {settings['random']!r}"
            )
        text = checks.json_text("task_kwargs", dict(settings))
        if isinstance(arena := settings.get("arena"), str):
            registry.arena_maker(arena)
        return cls(body, registry.importable("task", task.name), text)

    @property
    def robot(self) -> str:
        """Name of the robot, with the module for one of another package, or the JSON text of another body."""
        return registry.importable("domain", self.body.name) if is_robot(self.body) else body_to_json(self.body)

    @property
    def name(self) -> str:
        """Name of the body in names of files."""
        return self.body.name

    def validation(self, count: int) -> "Setup":
        """Return the setup that evaluates a policy while it learns: this one, without a curriculum.

        A curriculum begins at its first level in an evaluation, so policies are compared at `difficulty` instead.
        """
        return dataclasses.replace(self, settings_json=self._judged_json())

    @property
    def env_id(self) -> str:
        """Gymnasium's id, `arc_suite/<robot>-<task>-v<version>`."""
        return registry.env_id(self.body.name, self.kind)

    @property
    def definition(self) -> Task:
        """The task, ready to run.

        Raises:
            ValueError: a setting that does not fit.
        """
        return self.prepared()[0]

    def prepared(self) -> tuple[Task, mujoco.MjModel]:
        """Return the task, ready to run, and the compiled model.

        Raises:
            ValueError: a setting that does not fit.
        """
        return prepared(self.body, self.task, self.task_kwargs)

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

    def make_vec(self, num_envs: int = 1, *, seed: int | None = None, **options) -> VectorEnv:
        """Open a vector environment.

        Args:
            num_envs: number of environments.
            seed: of the first environment's stream of episodes; the others count on. None for random ones.
            options: see `arc_suite.envs.vector.VectorEnv`.
        """
        return VectorEnv(self.body, self.task, num_envs, task_kwargs=self._seeded(seed), **options)

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

    def provenance(self) -> dict[str, Any]:
        """Return, JSON-able, `to_dict` with the task's version, and hashes and versions of all that computes.

        Raises:
            ValueError: a setting that does not fit.
        """
        model = self.prepared()[1]
        buffer = np.zeros(mujoco.mj_sizeModel(model), np.uint8)
        mujoco.mj_saveModel(model, None, buffer)
        return self.to_dict() | {
            "task_version": self.kind.version,
            "body_sha256": hashlib.sha256(body_to_json(self.body).encode()).hexdigest(),
            "model_sha256": hashlib.sha256(buffer.data).hexdigest(),
            "versions": versions.recorded(),
        }

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
                raise ValueError(f"expected {name} to be a {kind.__name__}, got {checks.quoted(fields.get(name))!r}")
        robot, task, settings = fields["robot"], fields["task"], fields["task_kwargs"]
        if robot.startswith("{"):
            body = body_from_json(robot)
        else:  # by its name alone: a path of a file is none
            robot = registry.imported("robot", robot).rpartition(":")[2]
            body = ROBOTS[checks.name(robot, ROBOTS, "robot")]
        registry.imported("task", task)
        registry.imported("arena", str(settings.get("arena", "flat")))
        return cls.of(body, task, settings)

    def __str__(self) -> str:
        return self._named(self.body.name)
