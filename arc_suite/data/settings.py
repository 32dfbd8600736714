"""Settings of datasets: all that their episodes depend on."""

import hashlib
import re
from pathlib import Path
from typing import Any, NamedTuple

from arc_suite import checks, policies, registry, seed_ranges
from arc_suite.cpg.selection import presets_of, suited_preset
from arc_suite.envs.setup import Setup
from arc_suite.envs.vector import VectorEnv
from arc_suite.evaluation import provenance
from arc_suite.policies import checkpoints
from arc_suite.tasks.contract import STEPS


class DatasetSettings(NamedTuple):
    """Settings on which the episodes of a dataset depend; episode k has the seed `seed + k`.

    Attributes:
        setup: body, task and settings of the task.
        policy: a name, or `module:attribute`; see `policies.policy`.
        presets: presets of the demonstrator, names or `module:name`; of n presets, the episode with seed s has number
            s modulo n. Empty for the one that suits the task and the body, and for other policies.
        noise: standard deviation of the normal noise on actions, which are clipped after it.
        seed: seed of the first episode, of `seed_ranges.COLLECTING`.
        steps: control steps after which an episode is truncated, unless the task's limit is shorter.
    """

    setup: Setup
    policy: str = "cpg"
    presets: tuple[str, ...] = ()
    noise: float = 0.0
    seed: int = seed_ranges.COLLECTING.start
    steps: int = STEPS

    def preset(self, seed: int) -> str | None:
        """Return the preset of the episode with this seed."""
        names = self.preset_names
        return names[seed % len(names)] if names else None

    @property
    def preset_names(self) -> tuple[str, ...]:
        """The presets of the demonstrator, also where none is named; empty for other policies."""
        if self.presets or self.policy != "cpg":
            return self.presets
        return (suited_preset(self.setup.definition),)

    def dataset_id(self, label: str = "") -> str:
        """Return the default id of such a dataset.

        Args:
            label: text that takes the place of the policy's name.
        """
        parts = [label or self.policy, *self.preset_names]
        if self.noise:
            parts.append(f"noise{self.noise:g}")
        if self.steps != STEPS:
            parts.append(f"{self.steps}steps")
        if self.setup.task_kwargs:
            parts.append(f"set{_sha256(self.setup.settings_json)[:8]}")
        name = re.sub(r"[^-a-zA-Z0-9]+", "_", "-".join(parts))
        return f"arc_suite/{self.setup.name}/{self.setup.kind.name}/{name}-v0"

    def environment(self, num_envs: int, threads: int | None = None) -> VectorEnv:
        """Return a vector environment in which the episodes can be played."""
        return self.setup.make_vec(num_envs, num_threads=threads, max_episode_steps=self.steps)

    def provenance(self) -> dict[str, Any]:
        """Return, JSON-able, the setup's provenance with the other settings and hashes of presets and policy files.

        For checkpoints of a run it holds their algorithm, environment steps, seed and mean return, too.

        Raises:
            ValueError: a setting of the task that does not fit.
        """
        names = self.preset_names
        presets = presets_of(self.setup.body) if names else {}
        record = self.setup.provenance() | self._asdict() | {"presets": list(names)}
        del record["setup"]
        record["presets_sha256"] = [
            _sha256(checks.full_repr(presets.get(registry.bare_name(preset)))) for preset in names
        ]
        policy_sha256 = provenance.policy_sha256(self.policy)
        if policy_sha256 is not None:
            record["policy_sha256"] = policy_sha256
        if policies.is_file(self.policy):
            record["agents"] = [agent._asdict() for agent in checkpoints.agents(Path(self.policy))]
        return record


def _sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
