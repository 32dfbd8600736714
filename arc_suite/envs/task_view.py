"""The attribute `task` of an environment: the same in dm_env, in Gymnasium and in vector environments."""

import collections
from collections.abc import Mapping
from typing import Any, Protocol, TypeAlias

import dm_env
import gymnasium
import numpy as np

from arc_suite.robots.spec import Body
from arc_suite.tasks import Task
from arc_suite.tasks.contract import Scene
from arc_suite.tasks.parameters import Parameters

# An environment of `arc_suite.load`, `gymnasium.make` or `gymnasium.make_vec`, in wrappers or not.
AnyEnvironment: TypeAlias = dm_env.Environment | gymnasium.Env[Any, Any] | gymnasium.vector.VectorEnv[Any, Any, Any]


class TaskSettings(Protocol):
    """Settings of a task: its class has further ones, and those of a task without a gait have no `parameters`.

    Attributes:
        parameters: the gait, the standing pose and the target velocity.
        weights: signed weight of every term of the reward.
    """

    parameters: Parameters
    weights: Mapping[str, float]

    def __getattr__(self, name: str) -> Any: ...


class TaskView:
    """The task of an environment, `environment.task`. Vector environments give arrays a leading axis of num_envs.

    Attributes:
        definition: the task itself, see `tasks.contract.Task`.
        terms: unweighted terms of the latest step's reward by name, each (...); empty before the first step.
        progress: how well the episodes have gone so far, metrics (...) by name.
        privileged: the present privileged observation, which no policy has, by the names of
            `definition.privileged_blocks`, each (..., size); see `tasks.privileged`.
    """

    definition: Task
    terms: Mapping[str, np.ndarray]
    progress: Mapping[str, Any]
    privileged: Mapping[str, np.ndarray]

    @property
    def body(self) -> Body:
        """The body that moves."""
        return self.definition.scene.body

    @property
    def scene(self) -> Scene:
        """The body, the arena and their model."""
        return self.definition.scene

    @property
    def settings(self) -> TaskSettings:
        """The settings of the task."""
        return self.definition.settings

    @property
    def sizes(self) -> Mapping[str, int]:
        """Sizes of the observation's blocks by name, in the order of the vector."""
        return self.definition.sizes

    def split(self, observation: np.ndarray) -> collections.OrderedDict[str, np.ndarray]:
        """Return an observation vector (..., size) as named blocks, views of it.

        Raises:
            ValueError: a vector of another size.
        """
        return self.definition.split(observation)
