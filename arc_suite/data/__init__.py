"""Datasets in Minari's format, for offline-RL libraries, with bit-exact replays.

A recorded episode, replayed::

    dataset = arc_suite.data.open("arc_suite/queen/walk/cpg-medium-v0")
    episode = dataset[0]
    track = style.record(dataset.settings.setup.load(), episode.playback(), episode.seed, max_steps=episode.length)
"""

from arc_suite import versions

with versions.require_extra("datasets need Minari", "data"):
    import h5py  # noqa: F401
    import minari  # noqa: F401

from arc_suite.data.collection import collect
from arc_suite.data.dataset import Dataset, open
from arc_suite.data.episodes import Episode
from arc_suite.data.settings import DatasetSettings
from arc_suite.data.verification import verify

__all__ = ["collect", "open", "verify", "Dataset", "Episode", "DatasetSettings"]
