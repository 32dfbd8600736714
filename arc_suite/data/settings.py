"""Settings of datasets: all that their episodes depend on."""

import copy
import hashlib
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
import mujoco
import numpy as np
from gymnasium.envs.registration import EnvSpec

from arc_suite import checks, policies, registry, versions
from arc_suite.cpg.demonstrator import presets_of
from arc_suite.envs.prepare import prepared
from arc_suite.envs.vector import VectorEnv
from arc_suite.policies import checkpoints, network
from arc_suite.robots import is_robot
from arc_suite.robots.spec import Body
from arc_suite.robots.spec_files import body_to_json
from arc_suite.tasks.contract import STEPS


class Settings(NamedTuple):
    """All that the episodes of a dataset depend on; episode k has the seed `seed + k` and nothing else of its own.

    Attributes:
        body: what moves.
        policy: a name, or `module:attribute`; see `policies.policy`.
        presets: of the demonstrator; the episode with seed s has the one at s modulo their number. Empty
            for other policies.
        noise: standard deviation of the normal noise on actions, which are clipped after it.
        seed: of the first episode.
        steps: after which an episode is truncated, if its task has not ended it before.
        task: name of the task.
        task_kwargs: its settings, as in `arc_suite.load`; plain values, which JSON can hold.
    """

    body: Body
    policy: str = "cpg"
    presets: tuple[str, ...] = ("medium",)
    noise: float = 0.0
    seed: int = 0
    steps: int = STEPS
    task: str = "walk"
    task_kwargs: Mapping[str, Any] = {}

    def preset(self, seed: int) -> str | None:
        """Return the preset of the episode with this seed."""
        return self.presets[seed % len(self.presets)] if self.presets else None

    def dataset_id(self, label: str = "") -> str:
        """Return the id under which such a dataset lies if no other is given.

        Args:
            label: in place of the policy's name.
        """
        parts = [label or self.policy, *self.presets]
        if self.noise:
            parts.append(f"noise{self.noise:g}")
        if self.steps != STEPS:
            parts.append(f"{self.steps}steps")
        if self.task_kwargs:
            parts.append(f"set{_sha256(self._settings_text().encode())[:8]}")
        name, task = re.sub(r"[^-a-zA-Z0-9]+", "_", "-".join(parts)), registry.task_of(self.task).name
        return f"arc_suite/{self.body.name}/{task}/{name}-v0"

    def environment_spec(self) -> EnvSpec:
        """Return the spec of the Gymnasium environment; a body that is no robot of the suite is in it as text.

        Raises:
            ValueError: a setting of the task that JSON cannot hold; one line.
        """
        task = registry.task_of(self.task)
        env_id = registry.env_id(self.body.name, task)
        settings = {"task_kwargs": json.loads(self._settings_text())} if self.task_kwargs else {}
        if is_robot(self.body):
            spec = copy.deepcopy(gymnasium.spec(env_id))
            spec.max_episode_steps = self.steps
            spec.kwargs |= settings
            return spec
        return EnvSpec(
            id=env_id,
            entry_point="arc_suite.envs.gym:Env",
            vector_entry_point="arc_suite.envs.vector:VectorEnv",
            max_episode_steps=self.steps,
            kwargs={"domain_name": body_to_json(self.body), "task_name": registry.importable("task", task.name)}
            | settings,
        )

    def environment(self, rows: int, threads: int | None = None) -> VectorEnv:
        """Return rows in which the episodes can be played."""
        return VectorEnv(
            self.body, self.task, rows, threads, max_episode_steps=self.steps, task_kwargs=self.task_kwargs
        )

    def provenance(self) -> dict:
        """Return, JSON-able, the settings, the versions of what computes, and the sha256 of the compiled model.

        The settings hold the task's version, and the sha256 of every preset's numbers, or of the policy's file,
        beside the names; of checkpoints of a run also their algorithm, environment steps, seed and mean return.
        """
        task, presets = registry.task_of(self.task), presets_of(self.body) if self.presets else {}
        settings = self._asdict() | {
            "body": self.body.name,
            "presets": list(self.presets),
            "presets_sha256": [_sha256(repr(presets.get(preset)).encode()) for preset in self.presets],
            "task": task.name,
            "task_version": task.version,
            "task_kwargs": json.loads(self._settings_text()),
        }
        if policies.is_file(self.policy):
            settings["policy_sha256"] = network.digest(self.policy)
            settings["agents"] = [agent._asdict() for agent in checkpoints.agents(Path(self.policy))]
        return {
            "settings": settings,
            "versions": versions.recorded(),
            "model_sha256": model_sha256(self.body, self.task, self.task_kwargs),
        }

    def _settings_text(self) -> str:
        return checks.json_text("task_kwargs", self.task_kwargs)


def model_sha256(body: Body, task: str, task_kwargs: Mapping[str, Any]) -> str:
    """Return the sha256 of the compiled model in which a body does a task, as MuJoCo saves it."""
    _, model = prepared(body, task, task_kwargs)
    buffer = np.zeros(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    return _sha256(buffer.data)


def _sha256(data) -> str:
    return hashlib.sha256(data).hexdigest()
