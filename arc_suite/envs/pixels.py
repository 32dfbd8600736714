"""Pictures as observations of Gymnasium's environments, single and vector ones.

For dm_env environments there is `dm_control.suite.wrappers.pixels.Wrapper`.
"""

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers import TransformObservation
from gymnasium.wrappers.vector import TransformObservation as TransformVectorObservation

_KEYS = {"rgb_array": "pixels", "depth_array": "depth"}  # name of the pictures among the observations, by render mode


def with_pixels(environment: gymnasium.Env | gymnasium.vector.VectorEnv):
    """Return an environment whose observations also contain the picture of its camera::

        environment = gymnasium.make(
            "arc_suite/queen-rough-v0", render_mode="depth_array", width=64, height=64, camera_id="eye"
        )
        environment = with_pixels(environment)     # observations: {"state": (size,), "depth": (64, 64)}

    A picture has the environment's size. In the render mode rgb_array it is `pixels`, (height, width, 3) uint8; in
    depth_array `depth`, (height, width) float32, m. Observations that are dictionaries keep their keys; an observation
    that is a vector gets the key `state`.

    Args:
        environment: made with a render mode, a size and a camera; the autoreset mode of a vector environment is
            NextStep or Disabled.

    Raises:
        ValueError: another render mode, or a vector environment in the mode SameStep, where the last picture of an
            episode is not available.
        RenderingUnavailable: no OpenGL here.
    """
    mode = environment.render_mode
    if mode not in _KEYS:
        raise ValueError(f"render_mode: pixels need one of {', '.join(_KEYS)}, got {mode}")
    key = _KEYS[mode]
    is_vector = isinstance(environment, gymnasium.vector.VectorEnv)
    if is_vector and environment.metadata.get("autoreset_mode") is AutoresetMode.SAME_STEP:
        raise ValueError("autoreset_mode: pixels need NextStep or Disabled, got SameStep")

    def add_picture(observation):
        picture = environment.render()  # a tuple of pictures from a vector environment
        return {**_to_dict(observation), key: np.stack(picture) if is_vector else picture}

    if not isinstance(environment, gymnasium.vector.VectorEnv):
        space = _space_with_picture(environment, environment.observation_space, key)
        return TransformObservation(environment, add_picture, space)
    single_space = _space_with_picture(environment, environment.single_observation_space, key)
    space = gymnasium.vector.utils.batch_space(single_space, environment.num_envs)
    return TransformVectorObservation(
        environment, add_picture, observation_space=space, single_observation_space=single_space
    )


def _to_dict(observation) -> dict:
    """Return an observation as a dictionary; a vector gets the key `state`."""
    return observation if isinstance(observation, dict) else {"state": observation}


def _space_with_picture(environment, space: gymnasium.Space, key: str) -> gymnasium.spaces.Dict:
    """Return the space of one environment's observation with a picture."""
    rendered = environment.unwrapped.render()
    picture = rendered[0] if isinstance(rendered, tuple) else rendered
    largest = 255 if key == "pixels" else np.inf
    picture_space = gymnasium.spaces.Box(0, largest, picture.shape, picture.dtype)
    spaces = dict(space) if isinstance(space, gymnasium.spaces.Dict) else {"state": space}
    return gymnasium.spaces.Dict({**spaces, key: picture_space})
