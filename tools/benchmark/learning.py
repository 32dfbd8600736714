"""How fast soft actor-critic learns on one core, and what the processor could do at most; needs JAX."""

import functools
import time
from collections.abc import Iterator

from arc_suite.simulation.cores import use_one_thread

use_one_thread()

import jax
import jax.numpy as jnp
import numpy as np

from arc_suite.learning.agents import off_policy
from arc_suite.learning.agents import soft_actor_critic as sac
from arc_suite.learning.agents.algorithms import ALGORITHMS
from arc_suite.learning.agents.learner import generator
from arc_suite.learning.agents.replay import Transitions

SIZE, JOINTS, BATCH, HIDDEN = 199, 18, 256, 256
_PRODUCTS = 50  # of matrices in a compiled call


def flops(with_policy: bool) -> float:
    """Return the floating-point operations of the products of an update with a batch of 256."""
    policy = SIZE * HIDDEN + HIDDEN * HIDDEN + 2 * HIDDEN * JOINTS
    critic = (SIZE + JOINTS) * HIDDEN + HIDDEN * HIDDEN + HIDDEN
    # Targets and values; gradients of the weights, and of what the second and third layer take in.
    products = policy + 2 * critic + 2 * (3 * critic - (SIZE + JOINTS) * HIDDEN)
    if (
        with_policy
    ):  # policy with all gradients; critics with those of what each layer takes in, actions alone in the first
        products += 3 * policy - SIZE * HIDDEN + 2 * (2 * critic - SIZE * HIDDEN)
    return 2.0 * BATCH * products


def seconds(work, count: int) -> float:
    """Return the processor time of one of `count` calls of `work(i)`, which returns what is to be waited for."""
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


def rate(name: str, updates: int, with_policy: bool, looked_up: bool = False) -> float:
    """Return updates a second of an algorithm, with noise and masks; in phases next actions are looked up."""
    random, hp = np.random.default_rng(0), ALGORITHMS[name].hyperparameters
    shapes = ((BATCH, SIZE), (BATCH, JOINTS), (BATCH,), (BATCH,), (BATCH, SIZE))
    batch = Transitions(*(random.normal(size=shape).astype(np.float32) for shape in shapes))
    metrics = off_policy.METRICS if with_policy else off_policy.METRICS_OF_CRITICS
    present = [sac.begin(hp, random, SIZE, JOINTS), off_policy.zeros(metrics)]
    next_actions = [np.zeros((BATCH, JOINTS), np.float32)] * 2 if looked_up else None

    def update(index):
        noise = sac.noise(hp, generator(0, "update", index), BATCH, JOINTS, with_policy)
        present[:] = off_policy.update(hp, *present, batch, noise, next_actions)
        return present[1]

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

    body, mean, log_std = trunk(SIZE), nn.Linear(HIDDEN, JOINTS), nn.Linear(HIDDEN, JOINTS)
    critics, targets = ([nn.Sequential(trunk(SIZE + JOINTS), nn.Linear(HIDDEN, 1)) for _ in range(2)] for _ in range(2))
    policy_parameters = [p for part in (body, mean, log_std) for p in part.parameters()]
    log_alpha = torch.zeros((), requires_grad=True)
    adams = [torch.optim.Adam(parameters, 3e-4) for parameters in (policy_parameters, [log_alpha])]
    adams += [torch.optim.Adam(critic.parameters(), 3e-4) for critic in critics]
    s, a, r, s2 = (torch.randn(shape) for shape in ((BATCH, SIZE), (BATCH, JOINTS), (BATCH,), (BATCH, SIZE)))

    def act(observations):
        hidden = body(observations)
        normal = torch.distributions.Normal(mean(hidden), log_std(hidden).clamp(-20, 2).exp())
        raw = normal.rsample()
        action = torch.tanh(raw)
        return action, (normal.log_prob(raw) - torch.log(1 - action**2 + 1e-6)).sum(-1)

    def update(_):
        alpha = log_alpha.exp().detach()
        with torch.no_grad():
            action, density = act(s2)
            least = torch.min(*(target(torch.cat([s2, action], -1)).squeeze(-1) for target in targets))
            wanted = r + 0.99 * (least - alpha * density)
        critics_loss = sum(((c(torch.cat([s, a], -1)).squeeze(-1) - wanted) ** 2).mean() for c in critics)
        for adam in adams:
            adam.zero_grad()
        critics_loss.backward()
        for critic in critics:
            critic.requires_grad_(False)
        action, density = act(s)
        value = sum(critic(torch.cat([s, action], -1)).squeeze(-1) for critic in critics) / 2
        (alpha * density - value).mean().backward()
        (-(log_alpha * (density.detach() - JOINTS)).mean()).backward()
        for critic in critics:
            critic.requires_grad_(True)
        for adam in adams:
            adam.step()
        with torch.no_grad():
            for target, critic in zip(targets, critics, strict=True):
                for slow, fast in zip(target.parameters(), critic.parameters(), strict=True):
                    slow.lerp_(fast, 0.005)

    return 1.0 / seconds(update, updates)


def measured(updates: int) -> Iterator[tuple[str, float, float]]:
    """Yield for each kind of update its name, updates a second, and the limit at the time."""
    kinds = (
        ("full, sac", True, lambda: rate("sac", updates, True)),
        ("full with dropout, speq", True, lambda: rate("speq", updates, True)),
        ("critics alone, in a phase, no dropout", False, lambda: rate("sac", updates, False, looked_up=True)),
        ("critics alone, in a phase, dropout, speq", False, lambda: rate("speq", updates, False, looked_up=True)),
        ("full, a plain loop in torch", True, lambda: torch_rate(updates)),
    )
    for name, with_policy, measure in kinds:
        before = product_rate()
        found = measure()
        if found is not None:
            yield name, found, 0.5 * (before + product_rate()) / flops(with_policy)
