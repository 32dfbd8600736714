"""Train PPO by CleanRL's algorithm for continuous actions, and judge it with arc-suite evaluate.

    cd examples/training
    python cleanrl_ppo.py --robot tick --task walk
    arc-suite evaluate --robot tick --task walk --policy cleanrl_ppo:make

CleanRL's scripts cannot be imported. This one is written anew, after `ppo_continuous_action.py` of version 1
(https://docs.cleanrl.dev/rl-algorithms/ppo/#ppo_continuous_actionpy), with its hyperparameters for MuJoCo's tasks:
one environment, a learning rate that falls to zero, clipped values, and a standard deviation that does not depend on
the state. As there, a time limit counts as an end of the task: the value after it is zero.

`make` is the function that makes a policy of the saved network, the .pt of the module's name next to it.
"""

import argparse
import functools
import pathlib

import gymnasium
import numpy as np
import torch
from gymnasium import wrappers
from torch import nn

import arc_suite  # noqa: F401 (registers the ids)

HORIZON = 2048  # steps of a rollout
EPOCHS, MINIBATCH = 10, 64
LEARNING_RATE, ADAM_EPSILON = 3e-4, 1e-5
DISCOUNT, GAE_LAMBDA = 0.99, 0.95
CLIP = 0.2  # of the ratio of probabilities, and of values
VALUE_WEIGHT, GRADIENT_NORM = 0.5, 0.5
HIDDEN = 64
MAX_INPUT = 10.0  # of normalized observations and rewards
VARIANCE_EPSILON = 1e-8  # of `NormalizeObservation`


class Agent(nn.Module):
    """Value function and Gaussian policy, which share no weights."""

    def __init__(self, observation_size: int, action_size: int):
        """Draw weights."""
        super().__init__()
        self.value = make_perceptron(observation_size, 1, output_gain=1.0)
        self.mean = make_perceptron(observation_size, action_size, output_gain=0.01)
        self.log_std = nn.Parameter(torch.zeros(action_size))

    def distribution(self, observations: torch.Tensor) -> torch.distributions.Normal:
        """Return the distribution of actions."""
        return torch.distributions.Normal(self.mean(observations), self.log_std.exp(), validate_args=False)


def make_perceptron(inputs: int, outputs: int, output_gain: float) -> nn.Sequential:
    """Return a perceptron of two hidden layers with orthogonal weights."""
    sizes_and_gains = [(inputs, HIDDEN, np.sqrt(2.0)), (HIDDEN, HIDDEN, np.sqrt(2.0)), (HIDDEN, outputs, output_gain)]
    layers = []
    for size, next_size, gain in sizes_and_gains:
        layer = nn.Linear(size, next_size)
        nn.init.orthogonal_(layer.weight, gain)
        nn.init.zeros_(layer.bias)
        layers += [layer, nn.Tanh()]
    return nn.Sequential(*layers[:-1])


def make_environment(robot: str, task: str) -> tuple[gymnasium.Env, wrappers.NormalizeObservation]:
    """Return an environment with normalized, clipped observations and rewards, and its statistics of observations."""
    environment = wrappers.ClipAction(gymnasium.make(f"arc_suite/{robot}-{task}-v0"))
    normalized = wrappers.NormalizeObservation(environment, epsilon=VARIANCE_EPSILON)
    environment = wrappers.TransformObservation(normalized, clip_input, normalized.observation_space)
    environment = wrappers.NormalizeReward(environment, gamma=DISCOUNT)
    return wrappers.TransformReward(environment, clip_input), normalized


def clip_input(values):
    """Clip normalized observations or a normalized reward."""
    return np.clip(values, -MAX_INPUT, MAX_INPUT)


def learn(agent: Agent, environment: gymnasium.Env, steps: int, seed: int) -> None:
    """Make rollouts and updates until at least so many environment steps are made."""
    optimizer = torch.optim.Adam(agent.parameters(), LEARNING_RATE, eps=ADAM_EPSILON)
    iterations = -(-steps // HORIZON)
    observation, _ = environment.reset(seed=seed)
    for iteration in range(iterations):
        optimizer.param_groups[0]["lr"] = LEARNING_RATE * (1.0 - iteration / iterations)
        rollout, observation = collect(agent, environment, observation)
        for _ in range(EPOCHS):
            for indices in torch.randperm(HORIZON).split(MINIBATCH):
                loss = compute_loss(agent, *(values[indices] for values in rollout))
                optimizer.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(agent.parameters(), GRADIENT_NORM)
                optimizer.step()


@torch.no_grad()
def collect(agent: Agent, environment: gymnasium.Env, observation: np.ndarray):
    """Return observations, actions, log probabilities, values and advantages of a rollout, and the next observation."""
    observations = torch.zeros(HORIZON, observation.size)
    actions = torch.zeros(HORIZON, environment.action_space.shape[0])
    rewards = np.zeros(HORIZON)
    continues = np.zeros(HORIZON)  # 1 where the episode goes on after the step
    for step in range(HORIZON):
        observations[step] = torch.from_numpy(observation)
        actions[step] = agent.distribution(observations[step]).sample()
        observation, rewards[step], terminated, truncated, _ = environment.step(actions[step].numpy())
        continues[step] = not (terminated or truncated)
        if terminated or truncated:
            observation, _ = environment.reset()

    log_probabilities = agent.distribution(observations).log_prob(actions).sum(1)
    values = agent.value(observations).flatten()
    next_observation = torch.from_numpy(observation).float()
    next_value = agent.value(next_observation).item()
    advantages = torch.from_numpy(compute_advantages(rewards, continues, np.append(values.numpy(), next_value))).float()
    return (observations, actions, log_probabilities, values, advantages), observation


def compute_advantages(rewards: np.ndarray, continues: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return generalized advantage estimates (steps,), given values (steps + 1,)."""
    advantages = np.zeros(len(rewards))
    advantage = 0.0
    for step in reversed(range(len(rewards))):
        error = rewards[step] + DISCOUNT * continues[step] * values[step + 1] - values[step]
        advantage = error + DISCOUNT * GAE_LAMBDA * continues[step] * advantage
        advantages[step] = advantage
    return advantages


def compute_loss(agent: Agent, observations, actions, old_log_probabilities, old_values, advantages) -> torch.Tensor:
    """Return the loss of a minibatch: clipped ratios of probabilities, and clipped values."""
    returns = advantages + old_values
    advantages = (advantages - advantages.mean()) / (advantages.std() + 1e-8)
    ratios = (agent.distribution(observations).log_prob(actions).sum(1) - old_log_probabilities).exp()
    policy_loss = -torch.min(advantages * ratios, advantages * ratios.clamp(1.0 - CLIP, 1.0 + CLIP)).mean()

    values = agent.value(observations).flatten()
    clipped_values = old_values + (values - old_values).clamp(-CLIP, CLIP)
    value_loss = 0.5 * torch.max((values - returns) ** 2, (clipped_values - returns) ** 2).mean()
    return policy_loss + VALUE_WEIGHT * value_loss


def make(robot):
    """Return the function from a time step to the deterministic action."""
    network, mean, deviation = _load()

    def act(timestep):
        observation = np.concatenate(list(timestep.observation.values()), dtype=np.float32)
        inputs = clip_input((observation - mean) / deviation).astype(np.float32)
        with torch.inference_mode():
            return network(torch.from_numpy(inputs)).numpy()

    return act


@functools.cache
def _load() -> tuple[nn.Module, np.ndarray, np.ndarray]:
    """Return the network, and mean and standard deviation of observations."""
    saved = torch.load(pathlib.Path(__file__).with_suffix(".pt"), weights_only=True)
    weights = saved["network"]
    network = make_perceptron(weights["0.weight"].shape[1], weights["4.bias"].shape[0], output_gain=0.01)
    network.load_state_dict(weights)
    return network, saved["mean"].numpy(), np.sqrt(saved["variance"].numpy() + VARIANCE_EPSILON)


def main():
    """Train and save."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robot", default="tick")
    parser.add_argument("--task", default="walk")
    parser.add_argument("--steps", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=100_000, help="evaluation plays seeds below 10,000")
    parser.add_argument("--output", type=pathlib.Path, default="cleanrl_ppo.pt")
    args = parser.parse_args()
    torch.manual_seed(args.seed)
    environment, normalized = make_environment(args.robot, args.task)
    agent = Agent(environment.observation_space.shape[0], environment.action_space.shape[0])
    learn(agent, environment, args.steps, args.seed)
    statistics = {"mean": normalized.obs_rms.mean, "variance": normalized.obs_rms.var}
    saved = {name: torch.from_numpy(values) for name, values in statistics.items()}
    torch.save(saved | {"network": agent.mean.state_dict()}, args.output)


if __name__ == "__main__":
    main()
