"""What a dataset is collected with: all that its episodes depend on."""

import copy
import hashlib
import re
from typing import NamedTuple

import gymnasium
import mujoco
import numpy as np
from gymnasium.envs.registration import EnvSpec

from arc_suite import registry, versions
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec import Body
from arc_suite.robots.spec_files import body_to_json
from arc_suite.tasks.walk import HORIZON


class Settings(NamedTuple):
    """What the episodes of a dataset depend on; episode k has the seed `seed + k` and nothing else of its own.

    Attributes:
        body: what walks.
        policy: a name, or `module:attribute`; see `policies.policy`.
        presets: of the demonstrator; the episode with seed s has the one at s modulo their number. Empty
            for other policies.
        noise: standard deviation of the normal noise on actions, which are clipped after it.
        seed: of the first episode.
        steps: after which an episode is truncated, 1000 at most.
    """

    body: Body
    policy: str = "cpg"
    presets: tuple[str, ...] = ("medium",)
    noise: float = 0.0
    seed: int = 0
    steps: int = HORIZON

    def preset(self, seed: int) -> str | None:
        """Of the episode with this seed."""
        return self.presets[seed % len(self.presets)] if self.presets else None

    def dataset_id(self) -> str:
        """The id under which such a dataset lies if no other is given."""
        parts = [self.policy, *self.presets]
        if self.noise:
            parts.append(f"noise{self.noise:g}")
        if self.steps != HORIZON:
            parts.append(f"{self.steps}steps")
        return f"arc_suite/{self.body.name}/{re.sub(r'[^-a-zA-Z0-9]+', '_', '-'.join(parts))}-v0"

    def environment_spec(self) -> EnvSpec:
        """Of the Gymnasium environment; a body that is no robot of the suite is in it as text."""
        env_id = f"arc_suite/{self.body.name}-walk-v0"
        if ROBOTS.get(self.body.name) == self.body:
            spec = copy.deepcopy(gymnasium.spec(env_id))
            spec.max_episode_steps = self.steps
            return spec
        return EnvSpec(
            id=env_id,
            entry_point="arc_suite.envs.gym:Env",
            vector_entry_point="arc_suite.envs.vector:VectorEnv",
            max_episode_steps=self.steps,
            kwargs={"domain_name": body_to_json(self.body), "task_name": "walk"},
        )

    def provenance(self) -> dict:
        """JSON-able: the settings, the versions of what computes, and the sha256 of the compiled model."""
        settings = self._asdict() | {"body": self.body.name, "presets": list(self.presets)}
        return {
            "settings": settings,
            "versions": versions.recorded(),
            "model_sha256": model_sha256(self.body),
        }


def model_sha256(body: Body) -> str:
    """Of the compiled model in which a body walks, as MuJoCo saves it."""
    model = registry.load(body, "walk").physics.model.ptr
    buffer = np.zeros(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    return hashlib.sha256(buffer.data).hexdigest()
