"""`TimeStep` of dm_env, with the types that this suite's environments put into it: dm_env leaves them open."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import dm_env
import numpy as np

if TYPE_CHECKING:

    class TimeStep(dm_env.TimeStep):
        """What a step and a reset return.

        Attributes:
            step_type: whether the episode begins, goes on or ends.
            reward: reward of the step. At the start of an episode it is None, which the type leaves out: programs that
                sum rewards read none there.
            discount: 0 where the episode terminates, else 1; None at the start, as the reward.
            observation: blocks (size,) by name; with `flat_observation` the block `observations` alone.
        """

        step_type: dm_env.StepType
        reward: float
        discount: float
        observation: Mapping[str, np.ndarray]

        def first(self) -> bool: ...
        def mid(self) -> bool: ...
        def last(self) -> bool: ...

else:
    TimeStep = dm_env.TimeStep
