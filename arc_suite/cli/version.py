"""One line that tells which suite this is: two clones of one version differ in folder and commit."""

from pathlib import Path

import arc_suite
from arc_suite.versions import commit_of_clone


def describe_suite() -> str:
    """Return version, folder and commit, such as "arc_suite 0.1.0, /home/me/arc, commit 1b2c3d4"."""
    text = f"arc_suite {arc_suite.__version__}, {Path(arc_suite.__file__).parents[1]}"
    commit = commit_of_clone()
    return f"{text}, commit {commit}" if commit else text
