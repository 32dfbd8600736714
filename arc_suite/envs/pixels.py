"""Pictures as observations of Gymnasium's environments, single and vector ones.

dm_env's have `dm_control.suite.wrappers.pixels.Wrapper`.
"""

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers import TransformObservation
from gymnasium.wrappers.vector import TransformObservation as TransformVectors

_KEYS = {"rgb_array": "pixels", "depth_array": "depth"}  # of a render mode's pictures among the observations


def with_pixels(environment: gymnasium.Env | gymnasium.vector.VectorEnv):
    """Return an environment whose observations also hold what its camera shows::

        environment = gymnasium.make(
            "arc_suite/queen-rough-v0", render_mode="depth_array", width=64, height=64, camera_id="eye"
        )
        environment = with_pixels(environment)     # observations: {"state": (size,), "depth": (64, 64)}

    A picture has the environment's size. In the render mode rgb_array it is `pixels`, (height, width, 3) uint8; in
    depth_array `depth`, (height, width) float32, m. Observations that have names keep them; vectors are `state`.

    Args:
        environment: made with a render mode, a size and a camera; a vector one restarts in the step after an
            episode's end, or at the caller's reset.

    Raises:
        ValueError: another render mode, or a vector environment in the mode SameStep, whose last pictures are gone.
        RenderingUnavailable: no OpenGL here.
    """
    mode = environment.render_mode
    if mode not in _KEYS:
        raise ValueError(f"render_mode: pixels need one of {', '.join(_KEYS)}, got {mode}")
    key, vector = _KEYS[mode], isinstance(environment, gymnasium.vector.VectorEnv)
    if vector and environment.metadata.get("autoreset_mode") is AutoresetMode.SAME_STEP:
        raise ValueError("autoreset_mode: pixels need NextStep or Disabled, got SameStep")

    def observed(observation):
        picture = environment.render()
        return {**_named(observation), key: np.stack(picture) if vector else picture}

    if not vector:
        return TransformObservation(environment, observed, _space(environment, environment.observation_space, key))
    single = _space(environment, environment.single_observation_space, key)
    space = gymnasium.vector.utils.batch_space(single, environment.num_envs)
    return TransformVectors(environment, observed, observation_space=space, single_observation_space=single)


def _named(observation) -> dict:
    return observation if isinstance(observation, dict) else {"state": observation}


def _space(environment, space: gymnasium.Space, key: str) -> gymnasium.spaces.Dict:
    """The space of an observation with a picture."""
    shown = environment.unwrapped.render()
    first = shown[0] if isinstance(shown, tuple) else shown
    box = gymnasium.spaces.Box(0, 255 if key == "pixels" else np.inf, first.shape, first.dtype)
    own = dict(space) if isinstance(space, gymnasium.spaces.Dict) else {"state": space}
    return gymnasium.spaces.Dict({**own, key: box})
