"""`Setup`: a body or several, a task and its settings as one value. It opens environments and is stored in files."""

import dataclasses
import functools
import hashlib
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import gymnasium
import mujoco
import numpy as np
from gymnasium.envs.registration import EnvSpec

from arc_suite import checks, registry, versions
from arc_suite.arenas import ground_text
from arc_suite.envs import dm
from arc_suite.envs.prepare import prepare_task
from arc_suite.envs.vector import VectorEnv
from arc_suite.robots import is_robot
from arc_suite.robots.spec import Body
from arc_suite.robots.spec_files import body_to_json
from arc_suite.simulation.model_hash import PHYSICS, hash_physics
from arc_suite.tasks.contract import Task

# Name of an attribute that `envs.sb3.VecEnv` gives its observation space: `Setup.to_dict` of the environments. An agent
# saves its observation space, and with it the setup of its training.
ATTRIBUTE = "arc_suite"
FIRST_VALIDATION_SEED = 100_000  # of bodies of a family; bodies from this seed on serve for validation alone


def pair_with_tasks(bodies: Sequence[Body], tasks: Sequence[str]) -> list[tuple[Body, str]]:
    """Return the bodies with the tasks of their environments, in order; after the last pair comes the first again.

    Among as many environments as there are bodies, each body has one, and the tasks take turns. Every further round of
    the bodies begins with the next task, so that all pairs follow.
    """
    pairs = []
    for first_task in range(len(tasks)):
        for index, body in enumerate(bodies):
            pairs.append((body, tasks[(first_task + index) % len(tasks)]))
    return pairs


@dataclasses.dataclass(frozen=True)
class Setup:
    """A body or several in a task with settings. `Setup.of` makes one and checks the names.

    Setups of equal content are equal, in whatever form their tasks and settings were written. Several bodies share one
    policy: actions are positions of joints, and environments are those of `arc_suite.bodies`. They may have several
    tasks, too.

    Attributes:
        domain: the body, or the text that names several: `family:first-last`, names with commas, or a list of JSON
            with the texts of bodies that come from files.
        task: name of the task, `module:name` for one of another package; of several tasks the names with commas.
        settings_json: JSON of the task's settings, keys in order.
    """

    domain: Body | str
    task: str = "walk"
    settings_json: str = "{}"

    @classmethod
    def of(
        cls,
        domain_name: str | os.PathLike[str] | Body,
        task_name: str = "walk",
        task_kwargs: Mapping[str, Any] | None = None,
    ) -> "Setup":
        """Return the setup for arguments of `arc_suite.load`, or for several bodies.

        Modules in names are imported. Values of settings are checked later: by `prepare`, or when an environment is
        opened.

        Args:
            domain_name: a body, see `registry.body_of`, or a text that names several, see `registry.bodies_of`.
            task_name: see `registry.task_of`; with several bodies also `registry.tasks_of`.
            task_kwargs: settings of the task that JSON can represent, without `random`; of several tasks, those that
                all of them have.

        Raises:
            ValueError: an unknown name, a setting that JSON cannot represent, or actions of several bodies other than
                positions.
            OSError: a file that cannot be read.
        """
        setup = cls._make(domain_name, task_name, task_kwargs)
        _ = setup.bodies  # makes the bodies, which raises an error for a name without a body
        return setup

    @classmethod
    def _make(cls, domain_name, task_name: str, task_kwargs: Mapping[str, Any] | None) -> "Setup":
        """Return the setup for arguments of `of`, without making several bodies."""
        has_several_bodies = registry.names_several_bodies(domain_name)
        settings = dict(checks.mapping("task_kwargs", task_kwargs))
        domain = registry.embed_bodies(domain_name) if has_several_bodies else registry.body_of(domain_name)
        tasks = registry.tasks_of(task_name)
        if len(tasks) > 1 and not has_several_bodies:
            raise ValueError(f"task {checks.preview(task_name)}: expected one with one body, got several")
        if "random" in settings:
            random = checks.preview(settings["random"])
            raise ValueError(f"setting 'random': expected none, as every episode has a seed, got {random}")
        if has_several_bodies:
            checks.name(settings.get("actions", "position"), ["position"], "actions of different bodies")
        if isinstance(settings.get("arena"), str | os.PathLike):
            settings["arena"] = registry.arena_word(settings["arena"])
            registry.arena_maker(settings["arena"])  # raises an error for an unknown name
        for task in tasks:
            for name in task.file_settings.keys() & settings.keys():
                settings[name] = task.file_settings[name].embed(settings[name])
        importable_settings = {registry.importable_name("modifier", name): value for name, value in settings.items()}
        settings_json = checks.json_text("task_kwargs", importable_settings)
        importable_names = [registry.importable_name("task", task.name) for task in tasks]
        return cls(domain, ",".join(importable_names), settings_json)

    @property
    def several(self) -> bool:
        """Whether the setup has several bodies."""
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
        """The text by which files name the bodies.

        The name of a robot, as `module:name` for one of another package; the JSON text of any other body; the text that
        names several bodies.
        """
        if isinstance(self.domain, str):
            return self.domain
        if is_robot(self.domain):
            return registry.importable_name("robot", self.domain.name)
        return body_to_json(self.domain)

    @property
    def name(self) -> str:
        """Name of the bodies for tables and the names of files; see `registry.distinct_name`."""
        return self._label.replace(":", ".").replace(",", "+")

    @property
    def _label(self) -> str:
        """Name of the bodies for people."""
        if isinstance(self.domain, str):
            return registry.label_bodies(self.domain)
        return registry.distinct_name(self.domain)

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
        """Class of the task, with its name and version; of several tasks that of the first."""
        return registry.task_of(self.tasks[0])

    @property
    def tasks(self) -> tuple[str, ...]:
        """Names of all tasks, in order."""
        return tuple(registry.split_task_names(self.task))

    @property
    def task_label(self) -> str:
        """Names of the tasks for people and the names of files, without modules."""
        return "+".join(task.name for task in registry.tasks_of(self.task))

    def moves_like(self, other: "Setup") -> bool:
        """Return whether another setup has the same episodes: at most name and looks of the body differ."""
        if self.several or other.several:
            return self == other
        return self.body.moves_like(other.body) and dataclasses.replace(self, domain=other.domain) == other

    @property
    def env_id(self) -> str:
        """Gymnasium's id, `arc_suite/<robot>-<task>-v<version>`."""
        return registry.env_id(registry.distinct_name(self.body), self.kind)

    @property
    def definition(self) -> Task:
        """The task, ready to run; of several bodies that of the first body, of several tasks the first.

        Raises:
            ValueError: a setting that does not fit.
        """
        task, _ = self.prepare()
        return task

    def prepare(self) -> tuple[Task, mujoco.MjModel]:
        """Return the task, ready to run, and the compiled model; of several bodies those of the first body.

        Raises:
            ValueError: a setting that does not fit.
        """
        first = self.members()[0]
        return prepare_task(first.domain, first.task, first.task_kwargs)

    def members(self) -> tuple["Setup", ...]:
        """Return the setup of each body in each task, in the order of environments; see `pair_with_tasks`.

        If there are several bodies, actions are positions.
        """
        setup = self.with_settings({"actions": "position"} if self.several else {})
        pairs = pair_with_tasks(self.bodies, self.tasks)
        return tuple(dataclasses.replace(setup, domain=body, task=task) for body, task in pairs)

    def with_settings(self, changes: Mapping[str, Any], dropped: Iterable[str] = ()) -> "Setup":
        """Return the setup with some settings changed, and without those that are dropped.

        Raises:
            ValueError: a setting that JSON cannot represent.
        """
        settings = {name: value for name, value in self.task_kwargs.items() if name not in dropped}
        return Setup._make(self.domain, self.task, settings | dict(changes))

    def learning(self) -> "Setup":
        """Return the setup to learn in: with `training_settings`. Policies are judged in the setup itself."""
        return self.with_settings(self.training_settings)

    @property
    def training_settings(self) -> dict[str, Any]:
        """Settings that the task has for training alone, except those that the setup itself gives.

        Several tasks have those in which all of them agree.
        """
        tasks = registry.tasks_of(self.task)
        return {
            name: value
            for name, value in self.kind.training.items()
            if name not in self.task_kwargs and all(task.training.get(name) == value for task in tasks)
        }

    def validation(self, count: int) -> "Setup":
        """Return the setup for evaluations of a policy while it learns.

        Several bodies of families are replaced by at most `count` bodies of these families from the seed
        `FIRST_VALIDATION_SEED` on, which training does not have. Of several other bodies the first `count` remain.
        """
        if not isinstance(self.domain, str):
            return self
        return dataclasses.replace(self, domain=_validation_bodies(self.domain, count))

    def judging(self) -> "Setup":
        """Return the setup for the evaluation of a policy of this one.

        It has all blocks of the observation; the policy itself leaves out those that it was trained without.
        """
        return self.with_settings({}, dropped=["exclude_blocks"])

    def load(self, seed: int | None = None, **options: Any) -> dm.Environment:
        """Open a dm_env.

        Args:
            seed: seed of the stream of episodes; None for a random one.
            options: see `arc_suite.load`.
        """
        return dm.load(self.body, self.task, self._task_kwargs_with(seed), **options)

    def make(self, **options: Any) -> gymnasium.Env[np.ndarray, np.ndarray]:
        """Open a Gymnasium environment; for the options see `gymnasium.make`."""
        return gymnasium.make(self.spec(), **options)

    def make_vec(self, num_envs: int = 1, *, seed: int | None = None, **options: Any) -> Any:
        """Open a `VectorEnv`; of several bodies a `BodiesEnv` with flat observations.

        Args:
            num_envs: number of environments; environment i has the body and the task of member i, see `members`.
            seed: seed of the first environment's stream of episodes; environment i has seed + i. None for random seeds.
            options: see `arc_suite.envs.vector.VectorEnv`.
        """
        options["task_kwargs"] = self._task_kwargs_with(seed)
        if self.several:
            bodies_env_class = registry.resolve(registry.BODIES_ENV)
            return bodies_env_class(self.task, num_envs, self.bodies, flat=True, **options)
        return VectorEnv(self.domain, self.task, num_envs, **options)

    def spec(self, max_episode_steps: int | None = None) -> EnvSpec:
        """Return the spec from which Gymnasium makes the environment, in other processes, too.

        Args:
            max_episode_steps: control steps after which Gymnasium truncates an episode; None for the task's limit.
        """
        kwargs: dict[str, Any] = {"domain_name": self.robot, "task_name": self.task}
        if self.task_kwargs:
            kwargs["task_kwargs"] = self.task_kwargs
        return EnvSpec(
            id=self.env_id,
            entry_point="arc_suite.envs.gym:Env",
            vector_entry_point="arc_suite.envs.vector:VectorEnv",
            max_episode_steps=max_episode_steps,
            kwargs=kwargs,
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the setup as files contain it, JSON-able: `robot`, `task`, `task_kwargs`."""
        return {"robot": self.robot, "task": self.task, "task_kwargs": self.task_kwargs}

    @classmethod
    def from_dict(cls, fields: Mapping[str, Any]) -> "Setup":
        """Return the setup in a file. No module is imported, and no other file is opened.

        Args:
            fields: those of `to_dict`, with unchecked values; other fields are ignored.

        Raises:
            ValueError: a field is missing, has another type, is an unknown name, or a name whose module has not been
                imported.
        """
        for name, field_type in (("robot", str), ("task", str), ("task_kwargs", dict)):
            value = fields.get(name)
            if not isinstance(value, field_type):
                raise ValueError(f"expected {name} to be a {field_type.__name__}, got {checks.preview(value)}")
        robot = registry.check_stored_robot(fields["robot"])
        for name in registry.split_task_names(fields["task"]):
            registry.refuse_import("task", name)
        settings = fields["task_kwargs"]
        registry.check_stored_settings(settings)
        return cls._make(robot, fields["task"], settings)

    def provenance(self) -> dict[str, Any]:
        """Return, JSON-able, everything that results depend on.

        It is `to_dict` with the task's version, hashes of bodies and model, and versions of packages. Several bodies
        have no hash of a model, and several tasks a list of versions.

        Raises:
            ValueError: a setting that does not fit.
        """
        texts = "".join(map(body_to_json, self.bodies))
        fields = self.to_dict()
        task_versions = [task.version for task in registry.tasks_of(self.task)]
        fields["task_version"] = task_versions[0] if len(task_versions) == 1 else task_versions
        fields["body_sha256"] = hashlib.sha256(texts.encode()).hexdigest()
        if not self.several:
            fields[PHYSICS] = self.physics_sha256
        fields["versions"] = versions.dependency_versions()
        return fields

    @functools.cached_property
    def physics_sha256(self) -> str:
        """The hash of the model, see `hash_physics`; of several bodies that of the first.

        Raises:
            ValueError: a setting that does not fit.
        """
        _, model = self.prepare()
        return hash_physics(model)

    def _task_kwargs_with(self, seed: int | None) -> dict[str, Any]:
        """Return the settings of the task, with the seed of an environment unless it is None."""
        if seed is None:
            return self.task_kwargs
        return self.task_kwargs | {"random": seed}

    def __str__(self) -> str:
        settings = self.labeled_settings
        settings_text = f", {json.dumps(settings)}" if settings else ""
        return f"{self._label}, {self.task_label}{settings_text}"

    @property
    def labeled_settings(self) -> dict[str, Any]:
        """Settings for people: a ground and a motion of a file by their names, in place of their texts."""
        settings = self.task_kwargs
        arena = settings.get("arena")
        if ground_text.is_text(arena):
            settings["arena"] = ground_text.name_of(arena)
        for name in self.kind.file_settings.keys() & settings.keys():
            settings[name] = self.kind.file_settings[name].label(settings[name])
        return settings


def _validation_bodies(robot: str, count: int) -> str:
    """Return the text that names at most `count` bodies for validation, given the text that names several bodies."""
    parts = registry.split_bodies(robot)
    families = list(dict.fromkeys(filter(None, map(registry.family_in, parts))))[:count]
    if not families:
        return registry.join_bodies(parts[:count])
    last_seed = FIRST_VALIDATION_SEED + count // len(families) - 1
    return ",".join(f"{family}:{FIRST_VALIDATION_SEED}-{last_seed}" for family in families)
