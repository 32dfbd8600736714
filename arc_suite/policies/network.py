"""Policies that are graphs, and the setups that they were trained in, as files.

A policy file is an archive of the graph's arrays with one JSON text:

    robot, task, task_kwargs    the setup that the policy was trained in
    blocks                      size of every block of the observation, in the order of the input
    nodes                       [operator, input, ...] for each node of the graph; see `graph`
    training_seeds              first and last seed of each range of episodes that the policy learned from, or null

It holds no pickle and no code, so reading a file of others runs nothing.
"""

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from arc_suite import archives, checks, files, registry, seed_ranges
from arc_suite.envs.setup import Setup
from arc_suite.policies.graph import Graph, Node, checked

PACKAGED = Path(__file__).with_name("packaged")  # policy files that come with the package

EXTENSION = ".npz"
FILE = f"policy{EXTENSION}"  # in the folder of a run

_MAX_BYTES = 1 << 28  # of a file, unpacked


class Network(NamedTuple):
    """A deterministic policy, and the setup it was trained in.

    Attributes:
        graph: from the flat observation (num_envs, size) to actions (num_envs, joints).
        setup: body, or bodies, task and settings.
        blocks: size of every block of the observation by name, in the order of the flat one.
        training_seeds: of the episodes that it learned from; None if they are unknown.
    """

    graph: Graph
    setup: Setup
    blocks: Mapping[str, int]
    training_seeds: seed_ranges.Ranges | None = None

    def __repr__(self) -> str:
        return f"Network({self.setup}: {self.size} observations)"  # without the weights

    @property
    def size(self) -> int:
        """Of a flat observation."""
        return sum(self.blocks.values())

    @property
    def joints(self) -> int:
        """Of an action."""
        return self.actions(np.zeros((1, self.size), np.float32)).shape[1]

    def actions(self, observations: np.ndarray) -> np.ndarray:
        """Return actions (num_envs, joints) float32 for flat observations (num_envs, size)."""
        return self.graph(observations.astype(np.float32, copy=False))

    # The protocol of acting.

    def reset(self, indices: Sequence[int], seeds: Sequence[int]) -> None:
        """Start episodes: nothing to do, as the policy remembers nothing."""

    def act(self, observation: Mapping[str, np.ndarray], rewards: np.ndarray) -> np.ndarray:
        """Return the actions (num_envs, joints) of a control step; see `Policy.act`.

        Blocks that its task excluded are left out.

        Raises:
            ValueError: other blocks than those.
        """
        excluded = self.setup.excluded_blocks
        sizes = {name: block.shape[-1] for name, block in observation.items() if name not in excluded}
        if sizes != dict(self.blocks):
            names = sorted(name for name in {*sizes, *self.blocks} if sizes.get(name, 0) != self.blocks.get(name, 0))
            wrong = ", ".join(f"{name} has {sizes.get(name, 0)}, not {self.blocks.get(name, 0)}" for name in names)
            further = set(names).isdisjoint(self.blocks)
            unread = f"exclude_blocks={json.dumps(names)} leaves out what it does not read"
            remedy = unread if further else "train with this body and task"
            own = f"{self.setup.name}, {self.setup.kind.name}"
            raise ValueError(f"policy of {own}: observations differ from those in training: {wrong} numbers; {remedy}")
        flat = np.concatenate([observation[name] for name in self.blocks], axis=-1, dtype=np.float32)
        return self.actions(flat).astype(float)


def save(path: str | os.PathLike, network: Network) -> None:
    """Write a policy file, atomically.

    Raises:
        OSError: it cannot be written.
    """
    nodes = [[node.operator, *node.inputs] for node in network.graph.nodes]
    known = network.setup.to_dict() | {"blocks": dict(network.blocks), "nodes": nodes}
    known["training_seeds"] = seed_ranges.to_json(network.training_seeds)
    with files.writing(path) as temporary:
        np.savez(temporary, policy=np.array(json.dumps(known)), **network.graph.arrays)  # type: ignore[arg-type]


def load(path: str | os.PathLike) -> Network:
    """Read a policy file, or that of a run's folder; nothing that it names is imported.

    Raises:
        ValueError: a damaged file, or a robot, task or arena whose module has not been imported.
        OSError: it cannot be read.
    """
    path = Path(path)
    path = path / FILE if path.is_dir() else path
    try:
        arrays = archives.read(path, _MAX_BYTES)
        known = checks.mapping("policy", json.loads(str(arrays.pop("policy"))))
        blocks = {
            name: checks.integer(f"block {name}", size, 0)
            for name, size in checks.mapping("blocks", known["blocks"]).items()
        }
        if "layers" in known:
            raise ValueError("holds layers, as policies did before they were graphs: train it again")
        nodes = tuple(Node(operator, tuple(inputs)) for operator, *inputs in known["nodes"])
        # Packaged policies are stored as float16.
        arrays = {name: a.astype(np.float32) if a.dtype == np.float16 else a for name, a in arrays.items()}
        graph = checked(Graph(nodes, arrays), sum(blocks.values()))
        setup = Setup.from_dict(known)
        _ = setup.excluded_blocks  # finds out at once whether they are names
        return Network(graph, setup, blocks, seed_ranges.from_json(known.get("training_seeds")))
    except FileNotFoundError:
        early = path.name == FILE and path.parent.is_dir()
        near = map(str, path.parent.glob("*"))
        remedy = "; a run writes it at its first evaluation" if early else checks.hint(str(path), near)
        raise OSError(f"cannot read {path}: no such file{remedy}") from None
    except registry.NotImported as error:
        raise ValueError(f"policy {path}: {error}") from None
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise ValueError(f"{path}: no policy, or a damaged one: {checks.quote(error)}") from None


def checkpoint_files(folder: Path) -> list[Path]:
    """Return the policy files of a folder of checkpoints, `FOLDER/<step>/policy.npz`, by their steps."""
    found = [path for path in folder.glob(f"*/{FILE}") if path.parent.name.isdecimal()]
    return sorted(found, key=lambda path: int(path.parent.name))
