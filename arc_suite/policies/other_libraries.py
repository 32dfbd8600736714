"""Policies in files of other libraries: by extension, the module that reads them.

A name is that of a file, or `FILE+FURTHER` with a further file that belongs to it, such as `ppo.zip+stats.pkl`.
"""

import os
import re
from pathlib import Path
from typing import NamedTuple, Protocol, cast

from arc_suite import registry, usage
from arc_suite.envs.setup import Setup
from arc_suite.policies.network import Network
from arc_suite.policies.protocol import Policy

# By extension: a module that has what `Reader` says; imported when a file is to be read.
READERS = {".zip": "arc_suite.policies.zips"}


class LoadedPolicy(Policy, Protocol):
    """A policy from a file of another library.

    Attributes:
        joints: number of joints that it moves.
    """

    joints: int

    def network(self, setup: Setup) -> Network:
        """Return the policy as a graph, for the setup that it was trained in.

        Raises:
            ValueError: it is no network of known layers.
        """
        ...


class Reader(Protocol):
    """A module that reads files of one extension. `load` alone may need the other library, and run code of a file.

    Attributes:
        NO_SETUP: what is said of a file that does not hold the setup that it was trained in.
    """

    NO_SETUP: str

    def setup(self, path: Path) -> Setup | None:
        """Return the setup that a file was trained in; None for one that does not hold it."""
        ...

    def digest(self, path: Path, further: Path | None) -> str:
        """Return the sha256 of the content of a policy, without times of its files."""
        ...

    def load(self, path: Path, further: Path | None) -> LoadedPolicy:
        """Return the policy of a file."""
        ...


class PolicyFile(NamedTuple):
    """A file of another library.

    Attributes:
        path: path of the file.
        further: a file that belongs to it; None for none.
        extension: extension of `READERS`.
    """

    path: Path
    further: Path | None
    extension: str

    @property
    def reader(self) -> Reader:
        """The module that reads it."""
        return cast(Reader, registry.resolve(READERS[self.extension]))

    def setup(self) -> Setup | None:
        """Return the setup that it was trained in; see `Reader.setup`."""
        return self.reader.setup(self.path)

    def digest(self) -> str:
        """Return the sha256 of its content; see `Reader.digest`."""
        return self.reader.digest(self.path, self.further)

    def load(self) -> LoadedPolicy:
        """Return its policy.

        Raises:
            ValueError: a damaged file, or a run learns that declares no policy as its source.
        """
        usage.add_source(usage.POLICY)
        return self.reader.load(self.path, self.further)


def find(name: str | os.PathLike[str]) -> PolicyFile | None:
    """Return the file of another library that a policy's name gives; None for a name of another kind."""
    text = os.fspath(name)
    for extension in READERS:
        match = re.fullmatch(rf"(.*?{re.escape(extension)})\+(.+)", text, re.IGNORECASE | re.DOTALL)
        if match is not None:
            return PolicyFile(Path(match[1]), Path(match[2]), extension)
        if text.lower().endswith(extension):
            return PolicyFile(Path(text), None, extension)
    return None


def with_further_file(path: str, further: str) -> str:
    """Return the name of a file with a further one that belongs to it."""
    return f"{path}+{further}"
