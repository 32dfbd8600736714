"""One line that tells which suite this is: two clones of one version differ in folder and commit."""

import subprocess
from pathlib import Path

import arc_suite
from arc_suite.versions import clone_folder

_TIMEOUT = 10.0  # s, of git


def describe_suite() -> str:
    """Return version, folder and commit, such as "arc_suite 0.1.0, /home/me/arc, commit 1b2c3d4"."""
    text = f"arc_suite {arc_suite.__version__}, {Path(arc_suite.__file__).parents[1]}"
    commit = _commit_of_clone()
    return f"{text}, commit {commit}" if commit else text


def _commit_of_clone() -> str:
    """Return the commit of the clone, with "-dirty" where files differ from it; "" without a clone or without git."""
    folder = clone_folder()
    if folder is None or not (folder / ".git").exists():
        return ""
    command = ["git", "-C", str(folder), "describe", "--always", "--dirty", "--exclude=*"]
    try:
        result = subprocess.run(command, capture_output=True, encoding="utf-8", timeout=_TIMEOUT)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return result.stdout.strip() if result.returncode == 0 else ""
