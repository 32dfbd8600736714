"""Policies that are graphs, and the setups in which they were trained, as files.

A policy file is an archive of the graph's arrays with one JSON text:

    robot, task, task_kwargs    the setup in which the policy was trained
    blocks                      size of every block of the observation, in the order of the input
    nodes                       [operator, input, ...] for each node of the graph; see `graph`
    training_seeds              first and last seed of each range of training episodes, or null
    physics_sha256              hash of the model of the training; earlier files, and several bodies, lack it

It holds no pickle and no code, so that reading a file runs nothing.
"""

import hashlib
import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from arc_suite import archives, checks, files, parsers, registry, seed_ranges, usage
from arc_suite.envs.setup import Setup
from arc_suite.policies.graph import Graph, Node, check_graph
from arc_suite.simulation.model_hash import PHYSICS

PACKAGED = Path(__file__).with_name("packaged")  # policy files that come with the package

EXTENSION = ".npz"
FILE = f"policy{EXTENSION}"  # in the folder of a run

_MAX_NAMES = 16  # of blocks in an error
_MAX_BYTES = 1 << 28  # of a file, unpacked


class Network(NamedTuple):
    """A deterministic policy, and the setup in which it was trained.

    Attributes:
        graph: from the flat observation (num_envs, size) to actions (num_envs, joints).
        setup: body, or bodies, task and settings.
        blocks: size of every block of the observation by name, in the order of the flat one.
        training_seeds: seeds of the episodes of its training; None if they are unknown.
        physics_sha256: hash of the model of its training; None if it is unknown.
    """

    graph: Graph
    setup: Setup
    blocks: Mapping[str, int]
    training_seeds: seed_ranges.Ranges | None = None
    physics_sha256: str | None = None

    def __repr__(self) -> str:
        return f"Network({self.setup}: {self.size} observations)"  # without the weights

    @property
    def size(self) -> int:
        """The size of a flat observation."""
        return sum(self.blocks.values())

    @property
    def joints(self) -> int:
        """The number of joints of an action."""
        return self.actions(np.zeros((1, self.size), np.float32)).shape[1]

    def actions(self, observations: np.ndarray) -> np.ndarray:
        """Return actions (num_envs, joints) float32 for flat observations (num_envs, size)."""
        return self.graph(observations.astype(np.float32, copy=False))

    def note_use(self) -> None:
        """Do nothing, as a network that was made in memory is the learner's; `StoredNetwork` adds its source."""

    # The protocol of acting.

    def reset(self, indices: Sequence[int], seeds: Sequence[int]) -> None:
        """Start episodes: nothing to do, as the policy remembers nothing."""

    def act(self, observation: Mapping[str, np.ndarray], rewards: np.ndarray) -> np.ndarray:
        """Return the actions (num_envs, joints) of a control step; see `Policy.act`.

        Blocks that were excluded in training are left out.

        Raises:
            ValueError: other blocks than those in training.
        """
        excluded = self.setup.excluded_blocks
        sizes = {name: block.shape[-1] for name, block in observation.items() if name not in excluded}
        if sizes != dict(self.blocks):
            names = sorted(name for name in {*sizes, *self.blocks} if sizes.get(name, 0) != self.blocks.get(name, 0))
            differences = ", ".join(
                f"{checks.quote(name)} has {sizes.get(name, 0)}, not {self.blocks.get(name, 0)}"
                for name in names[:_MAX_NAMES]
            )
            are_all_additional = set(names).isdisjoint(self.blocks)
            if are_all_additional:
                hint = f"exclude_blocks={checks.quote(json.dumps(names))} leaves out what it does not read"
            else:
                hint = "train with this body and task"
            setup_text = f"{self.setup.name}, {self.setup.task_label}"
            raise ValueError(
                f"policy of {setup_text}: observations differ from those in training: {differences} numbers; {hint}"
            )
        flat = np.concatenate([observation[name] for name in self.blocks], axis=-1, dtype=np.float32)
        return self.actions(flat).astype(float)


class StoredNetwork(Network):
    """A network from a file. A run that acts by it, or reads its graph, uses a policy."""

    @property
    def graph(self) -> Graph:
        """The graph; see `Network`."""
        self.note_use()
        return self[0]

    def note_use(self) -> None:
        """Add a policy to the sources of the run that learns.

        Raises:
            ValueError: the run declares no policy as its source.
        """
        usage.add_source(usage.POLICY)


def save(path: str | os.PathLike[str], network: Network) -> None:
    """Write a policy file, atomically.

    Raises:
        OSError: it cannot be written.
    """
    nodes = [[node.operator, *node.inputs] for node in network.graph.nodes]
    record = network.setup.to_dict() | {"blocks": dict(network.blocks), "nodes": nodes}
    record["training_seeds"] = seed_ranges.to_json(network.training_seeds)
    if not network.setup.several:
        record[PHYSICS] = network.setup.physics_sha256
    with files.writing(path) as temporary, open(temporary, "wb") as file:  # by its path, savez adds an extension
        np.savez(file, policy=np.array(json.dumps(record)), **network.graph.arrays)  # type: ignore[arg-type]


def digest(network: Network) -> str:
    """Return the sha256 of what a policy computes: its blocks, operators, and arrays with names, shapes and bytes.

    The bytes of a file differ with its compression and its times, and with the type in which it stores numbers.
    """
    nodes = [[node.operator, *node.inputs] for node in network.graph.nodes]
    arrays = {name: np.ascontiguousarray(array) for name, array in sorted(network.graph.arrays.items())}
    shapes = {name: [array.dtype.str, *array.shape] for name, array in arrays.items()}
    content_hash = hashlib.sha256(json.dumps([list(network.blocks.items()), nodes, shapes]).encode())
    for array in arrays.values():
        content_hash.update(array.tobytes())
    return content_hash.hexdigest()


def load(path: str | os.PathLike[str]) -> Network:
    """Read a policy file, or that of a run's folder; nothing that it names is imported.

    Raises:
        NotImported: the module of a robot, task or arena has not been imported yet.
        ValueError: a damaged file; or a run learns that declares no policy as its source.
        OSError: it cannot be read.
    """
    usage.add_source(usage.POLICY)
    path = Path(path)
    if path.is_dir():
        path = path / FILE
    if not path.exists():
        is_of_run = path.name == FILE and path.parent.is_dir()
        hint = "; a run writes it at its first evaluation" if is_of_run else files.suggest_path(path)
        raise OSError(f"cannot read {path}: no such file{hint}")
    try:
        with parsers.guard(f"{path}: no policy, or a damaged one", passes=(registry.NotImported,)):
            return _read(path)
    except registry.NotImported as error:
        raise registry.NotImported(f"policy {path}: {error}") from None


def _read(path: Path) -> Network:
    """Return the policy of a file; a damaged one raises anything."""
    arrays = archives.read(path, _MAX_BYTES)
    record = checks.mapping("policy", json.loads(str(arrays.pop("policy"))))
    blocks = {
        name: checks.integer(f"block {name}", size, 0)
        for name, size in checks.mapping("blocks", record["blocks"]).items()
    }
    if "layers" in record:
        raise ValueError("holds layers, as policies did before they were graphs: train it again")
    nodes = tuple(Node(operator, tuple(inputs)) for operator, *inputs in record["nodes"])
    for name, array in arrays.items():
        if array.dtype == np.float16:  # as packaged policies are stored
            arrays[name] = array.astype(np.float32)
    graph = check_graph(Graph(nodes, arrays), sum(blocks.values()))
    setup = Setup.from_dict(record)
    _ = setup.excluded_blocks  # raises an error if they are no names
    physics_sha256 = record.get(PHYSICS)
    if physics_sha256 is not None and not isinstance(physics_sha256, str):
        raise ValueError(f"expected {PHYSICS} to be a str, got {checks.preview(physics_sha256)}")
    return StoredNetwork(graph, setup, blocks, seed_ranges.from_json(record.get("training_seeds")), physics_sha256)


def checkpoint_files(folder: Path) -> list[Path]:
    """Return the policy files of a folder of checkpoints, `FOLDER/<step>/policy.npz`, by their steps."""
    paths = [path for path in folder.glob(f"*/{FILE}") if path.parent.name.isdecimal()]
    return sorted(paths, key=lambda path: int(path.parent.name))
