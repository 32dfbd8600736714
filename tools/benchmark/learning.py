"""How fast soft actor-critic learns on one core, and what the processor could do at most; needs JAX."""

import functools
import time
from collections.abc import Iterator

from arc_suite.simulation.cores import prepare_jax

prepare_jax()

import jax
import jax.numpy as jnp
import numpy as np

from arc_suite.learning.agents import off_policy
from arc_suite.learning.agents import soft_actor_critic as sac
from arc_suite.learning.agents.algorithms import ALGORITHMS
from arc_suite.learning.agents.replay import Transitions

SIZE = 199  # numbers of Queen's observation
JOINTS = 18
BATCH = 256
HIDDEN = 256  # units of a layer
_PRODUCTS = 50  # products of matrices in a compiled call


def flops(with_policy: bool) -> float:
    """Return the floating-point operations of the products of an update with a batch of 256."""
    policy = SIZE * HIDDEN + HIDDEN * HIDDEN + 2 * HIDDEN * JOINTS
    critic = (SIZE + JOINTS) * HIDDEN + HIDDEN * HIDDEN + HIDDEN
    # Targets and values; gradients of the weights, and of the inputs of the second and third layer.
    products = policy + 2 * critic + 2 * (3 * critic - (SIZE + JOINTS) * HIDDEN)
    if with_policy:
        # The policy with all gradients; the critics with gradients of inputs, in the first layer of actions alone.
        products += 3 * policy - SIZE * HIDDEN + 2 * (2 * critic - SIZE * HIDDEN)
    return 2.0 * BATCH * products


def seconds(work, count: int) -> float:
    """Return the mean processor time of `count` calls of `work(index)`, which returns arrays to wait for."""
    jax.block_until_ready(work(0))
    start = time.process_time()
    for index in range(count):
        result = work(index)
    jax.block_until_ready(result)
    return (time.process_time() - start) / count


def product_rate() -> float:
    """Return floating-point operations a second in products of matrices 256 x 256."""
    matrix = jnp.full((256, 256), 1.0 / 256)
    chain = jax.jit(lambda a: functools.reduce(lambda x, _: x @ a, range(_PRODUCTS), a))
    return _PRODUCTS * 2.0 * 256**3 / seconds(lambda _: chain(matrix), 20)


def rate(name: str, updates: int, with_policy: bool, in_phase: bool = False) -> float:
    """Return updates a second of an algorithm, with noise and masks; in phases, next actions are stored ones."""
    random = np.random.default_rng(0)
    hp = ALGORITHMS[name].hyperparameters
    shapes = ((BATCH, SIZE), (BATCH, JOINTS), (BATCH,), (BATCH,), (BATCH, SIZE))
    batch = Transitions(*(random.normal(size=shape).astype(np.float32) for shape in shapes))
    metrics = off_policy.METRICS if with_policy else off_policy.CRITIC_METRICS
    learner_state = sac.begin(hp, random, SIZE, JOINTS)
    sums = off_policy.zero_sums(metrics)
    next_actions = [np.zeros((BATCH, JOINTS), np.float32)] * 2 if in_phase else None
    draw_noise = jax.jit(lambda index: sac.draw_noise(hp, jax.random.key(index), BATCH, (JOINTS,), with_policy))

    def update(index):
        nonlocal learner_state, sums
        learner_state, sums = off_policy.make_update(hp, learner_state, sums, batch, draw_noise(index), next_actions)
        return sums

    return 1.0 / seconds(update, updates)


def torch_rate(updates: int) -> float | None:
    """Return full updates a second of a plain loop in PyTorch; None without torch."""
    try:
        import torch
        from torch import nn
    except ImportError:
        return None
    torch.set_num_threads(1)

    def trunk(inputs):
        layers = [nn.Linear(inputs, HIDDEN), nn.LayerNorm(HIDDEN), nn.ReLU()]
        return nn.Sequential(*layers, nn.Linear(HIDDEN, HIDDEN), nn.LayerNorm(HIDDEN), nn.ReLU())

    def critic_network():
        return nn.Sequential(trunk(SIZE + JOINTS), nn.Linear(HIDDEN, 1))

    policy_trunk = trunk(SIZE)
    mean_layer = nn.Linear(HIDDEN, JOINTS)
    log_std_layer = nn.Linear(HIDDEN, JOINTS)
    critics = [critic_network(), critic_network()]
    targets = [critic_network(), critic_network()]
    policy_parameters = [
        parameter for module in (policy_trunk, mean_layer, log_std_layer) for parameter in module.parameters()
    ]
    log_temperature = torch.zeros((), requires_grad=True)
    optimizers = [torch.optim.Adam(parameters, 3e-4) for parameters in (policy_parameters, [log_temperature])]
    optimizers += [torch.optim.Adam(critic.parameters(), 3e-4) for critic in critics]
    observations = torch.randn((BATCH, SIZE))
    actions = torch.randn((BATCH, JOINTS))
    rewards = torch.randn((BATCH,))
    next_observations = torch.randn((BATCH, SIZE))

    def act(inputs):
        hidden = policy_trunk(inputs)
        normal = torch.distributions.Normal(mean_layer(hidden), log_std_layer(hidden).clamp(-20, 2).exp())
        unbounded = normal.rsample()
        sampled_actions = torch.tanh(unbounded)
        log_density = (normal.log_prob(unbounded) - torch.log(1 - sampled_actions**2 + 1e-6)).sum(-1)
        return sampled_actions, log_density

    def value_of(critic, inputs, of_actions):
        return critic(torch.cat([inputs, of_actions], -1)).squeeze(-1)

    def update(_):
        temperature = log_temperature.exp().detach()
        with torch.no_grad():
            next_actions, log_density = act(next_observations)
            next_value = torch.min(*(value_of(target, next_observations, next_actions) for target in targets))
            goals = rewards + 0.99 * (next_value - temperature * log_density)
        critics_loss = sum(((value_of(critic, observations, actions) - goals) ** 2).mean() for critic in critics)
        for optimizer in optimizers:
            optimizer.zero_grad()
        critics_loss.backward()
        for critic in critics:
            critic.requires_grad_(False)
        sampled_actions, log_density = act(observations)
        value = sum(value_of(critic, observations, sampled_actions) for critic in critics) / 2
        (temperature * log_density - value).mean().backward()
        (-(log_temperature * (log_density.detach() - JOINTS)).mean()).backward()
        for critic in critics:
            critic.requires_grad_(True)
        for optimizer in optimizers:
            optimizer.step()
        with torch.no_grad():
            for target, critic in zip(targets, critics, strict=True):
                for slow, fast in zip(target.parameters(), critic.parameters(), strict=True):
                    slow.lerp_(fast, 0.005)

    return 1.0 / seconds(update, updates)


def measure(updates: int) -> Iterator[tuple[str, float, float]]:
    """Yield for each kind of update its name, updates a second, and the limit at the time."""
    kinds = (
        ("full, sac", True, lambda: rate("sac", updates, True)),
        ("full with dropout, speq", True, lambda: rate("speq", updates, True)),
        ("critics alone, in a phase, no dropout", False, lambda: rate("sac", updates, False, in_phase=True)),
        ("critics alone, in a phase, dropout, speq", False, lambda: rate("speq", updates, False, in_phase=True)),
        ("full, a plain loop in torch", True, lambda: torch_rate(updates)),
    )
    for name, with_policy, measure_rate in kinds:
        product_rate_before = product_rate()
        updates_per_second = measure_rate()
        if updates_per_second is not None:
            products_per_second = 0.5 * (product_rate_before + product_rate())
            yield name, updates_per_second, products_per_second / flops(with_policy)
