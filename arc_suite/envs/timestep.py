"""`TimeStep` of dm_env, with the types that this suite's environments put into it: dm_env leaves them open."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from arc_suite.envs.dm_types import TimeStep
else:
    from dm_env import TimeStep

__all__ = ["TimeStep"]
