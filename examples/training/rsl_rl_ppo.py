"""Train PPO of rsl_rl with the hyperparameters of legged robots, and judge it with arc-suite evaluate.

    cd examples/training
    python rsl_rl_ppo.py --robot tick --task steer
    arc-suite evaluate --robot tick --task steer --policy rsl_rl_ppo:make

The hyperparameters are those of Rudin et al., "Learning to walk in minutes using massively parallel deep reinforcement
learning", 2021, Table 2, with 64 environments in place of 4096. What the paper's environments do, `Environments` does
here (https://github.com/leggedrobotics/legged_gym, `legged_robot_config.py`):

- Rewards are multiplied by the control step. The library clips the change of a value at 0.2, which is too little for
  returns in the hundreds.
- Actions are multiplied by 0.5. Their standard deviation begins at 1. In the first 250,000 steps it falls by less than
  1 %, as the learning rate soon has its lowest value. Without the factor, more than a third of the actions are beyond
  the limits of motors, [-1, 1]: a run of a million steps scored -0.03 on `walk`, in five episodes.

Observations have scales by hand there; here the library normalizes them.

`make` is the function that makes a policy of the saved network, the .pt of the module's name next to it.
"""

import argparse
import functools
import pathlib

import gymnasium
import numpy as np
import torch
from rsl_rl.env import VecEnv
from rsl_rl.runners import OnPolicyRunner
from tensordict import TensorDict

import arc_suite  # noqa: F401 (registers the ids)

ENVS = 64
HORIZON = 24  # control steps of a rollout
ACTION_SCALE = 0.5

_NETWORK = {
    "class_name": "MLPModel",
    "hidden_dims": [512, 256, 128],
    "activation": "elu",
    "obs_normalization": True,
}
RUNNER = {
    "num_steps_per_env": HORIZON,
    "save_interval": 1 << 30,  # iterations; the script saves the policy
    "obs_groups": {"actor": ["policy"], "critic": ["policy"]},
    "actor": _NETWORK | {"distribution_cfg": {"class_name": "GaussianDistribution", "init_std": 1.0}},
    "critic": _NETWORK,
    "algorithm": {"class_name": "PPO"},  # the library's defaults are those of the paper
}


class Environments(VecEnv):
    """The suite's vector environment as rsl_rl takes it. Episodes start anew in the step that ends one."""

    def __init__(self, robot: str, task: str, num_envs: int, seed: int):
        """Begin the first episodes."""
        env_id = f"arc_suite/{robot}-{task}-v0"
        self._vector = gymnasium.make_vec(env_id, num_envs=num_envs, autoreset_mode="SameStep")
        observations, _ = self._vector.reset(seed=seed)
        self._observations = self._to_groups(observations)
        self.num_envs = num_envs
        self.num_actions = self._vector.single_action_space.shape[0]
        self.max_episode_length = int(self._vector.unwrapped.task.definition.step_limit)
        self.episode_length_buf = torch.zeros(num_envs, dtype=torch.long)
        self._control_step = self._vector.unwrapped.task.scene.control_timestep  # s
        self.device = "cpu"
        self.cfg = {"env_id": env_id}

    def get_observations(self) -> TensorDict:
        """Return the latest observations."""
        return self._observations

    def step(self, actions: torch.Tensor):
        """Make a control step; return observations, rewards, ends of episodes, and which of them are time limits."""
        observations, rewards, terminated, truncated, _ = self._vector.step(ACTION_SCALE * actions.numpy())
        has_ended = torch.from_numpy(terminated | truncated)
        self.episode_length_buf = torch.where(has_ended, 0, self.episode_length_buf + 1)
        self._observations = self._to_groups(observations)
        extras = {"time_outs": torch.from_numpy(truncated & ~terminated)}
        return self._observations, torch.from_numpy(rewards * self._control_step).float(), has_ended, extras

    def _to_groups(self, observations: np.ndarray) -> TensorDict:
        return TensorDict({"policy": torch.from_numpy(observations)}, batch_size=[len(observations)])


def make(robot):
    """Return the function from a time step to the deterministic action."""
    network = _load()

    def act(timestep):
        observation = np.concatenate(list(timestep.observation.values()), dtype=np.float32)
        with torch.inference_mode():
            return ACTION_SCALE * network(torch.from_numpy(observation)[None])[0].numpy()

    return act


@functools.cache
def _load() -> torch.jit.ScriptModule:
    return torch.jit.load(pathlib.Path(__file__).with_suffix(".pt"))


def main():
    """Train and save."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robot", default="tick")
    parser.add_argument("--task", default="walk")
    parser.add_argument("--steps", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=100_000, help="evaluation plays seeds below 10,000")
    parser.add_argument("--output", type=pathlib.Path, default="rsl_rl_ppo.pt")
    args = parser.parse_args()
    torch.manual_seed(args.seed)
    environments = Environments(args.robot, args.task, ENVS, args.seed)
    runner = OnPolicyRunner(environments, RUNNER)
    runner.learn(-(-args.steps // (ENVS * HORIZON)))
    runner.export_policy_to_jit(args.output.parent, args.output.name)


if __name__ == "__main__":
    main()
