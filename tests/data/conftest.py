"""Where Minari keeps the datasets of a test."""

import pytest
from datasets import ID, SETTINGS, collect


@pytest.fixture(autouse=True)
def root(tmp_path, monkeypatch):
    """Return the folder in which Minari keeps datasets."""
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "datasets"))
    return tmp_path / "datasets"


@pytest.fixture
def kept(root):
    """Collect two episodes, and return the folder in which Minari keeps datasets."""
    collect(ID, SETTINGS, 2)
    return root
