"""Gymnasium's ids, `arc_suite/<robot>-<task>-v0`, one for each task of the suite."""

import gymnasium

from arc_suite.suite import ALL_TASKS

MAX_EPISODE_STEPS = 1000


def register() -> None:
    """Registers every task that is not yet registered; the adapter is imported when one is made."""
    for domain_name, task_name in ALL_TASKS:
        env_id = f"arc_suite/{domain_name}-{task_name}-v0"
        if env_id not in gymnasium.registry:
            gymnasium.register(
                env_id,
                entry_point="arc_suite.gym:Env",
                vector_entry_point="arc_suite.vector:VectorEnv",
                max_episode_steps=MAX_EPISODE_STEPS,
                kwargs={"domain_name": domain_name, "task_name": task_name},
            )
