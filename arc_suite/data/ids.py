"""Ids of datasets, and where Minari keeps them."""

import os
import re
from pathlib import Path

from minari.dataset.minari_dataset import parse_dataset_id
from minari.storage import get_dataset_path

from arc_suite import checks

_VERSION_SUFFIX = re.compile(r"-v\d+$")
_MAX_LENGTH = 1000  # characters; Minari's time to parse an id grows with the square of its length


def check(dataset_id: str) -> str:
    """Return the id if Minari admits it, and it does not lie within another dataset.

    Raises:
        ValueError: it is no such id, it is too long, or the version is missing.
    """
    if isinstance(dataset_id, str) and len(dataset_id) > _MAX_LENGTH:
        raise ValueError(f"dataset id {checks.preview(dataset_id)}: expected at most {_MAX_LENGTH} characters")
    if not _is_valid(dataset_id):
        with_version = f"{dataset_id}-v0"
        example = checks.preview(with_version if _is_valid(with_version) else "arc_suite/queen/walk/cpg-medium-v0")
        raise ValueError(
            f"dataset id {checks.preview(dataset_id)}: expected names of letters, digits, '-' and '_' with '/' "
            f"between, two characters at least before the last '/', and a version at the end alone, such as {example}"
        )
    return dataset_id


def _is_valid(dataset_id: str) -> bool:
    try:
        namespace, _, _ = parse_dataset_id(dataset_id)
    except (TypeError, ValueError):  # Minari raises a TypeError if the version is missing
        return False
    if namespace is None:
        return True
    # Minari lists no dataset within another one, and a replacement of the outer one would delete it.
    return not any(_VERSION_SUFFIX.search(part) for part in namespace.split("/"))


def root() -> Path:
    """Return the folder of all datasets, which Minari makes where it is missing.

    Raises:
        OSError: the folder cannot be made, as where there is no home.
    """
    try:
        if "MINARI_DATASETS_PATH" not in os.environ:
            Path.home()  # raises a RuntimeError for a user without a home, where Minari would make a folder `~`
        return get_dataset_path()
    except (OSError, RuntimeError) as error:
        raise OSError(
            f"cannot make the folder of datasets: {checks.quote(error)}; set MINARI_DATASETS_PATH to another folder"
        ) from None


def folder(dataset_id: str) -> Path:
    """Return the folder in which a dataset of this id lies, or would lie.

    Raises:
        ValueError: no id of a dataset.
        OSError: as `root`.
    """
    check(dataset_id)
    return root() / dataset_id


def parts_folder(dataset_id: str) -> Path:
    """Return the hidden folder of the episodes that are not merged into the dataset yet."""
    dataset_folder = folder(dataset_id)
    return dataset_folder.with_name(f".{dataset_folder.name}.parts")


def existing() -> list[str]:
    """Return the ids of all datasets on this machine; hidden folders do not count."""
    top = root()
    folders = sorted(path.parent.parent.relative_to(top) for path in top.rglob("data/metadata.json"))
    return [path.as_posix() for path in folders if not any(part.startswith(".") for part in path.parts)]


def find(dataset_id: str) -> Path:
    """Return the folder in which a dataset lies.

    Raises:
        ValueError: a malformed id, no such dataset, or one whose first collection was killed.
    """
    if not folder(dataset_id).joinpath("data").is_dir():
        if parts_folder(dataset_id).is_dir():
            raise ValueError(f"dataset {checks.preview(dataset_id)} is unfinished: collect it again to continue it")
        dataset_ids = existing()
        if not dataset_ids:
            raise ValueError(f"unknown dataset {checks.preview(dataset_id)}: there are none in {root()}")
        checks.name(dataset_id, dataset_ids, "dataset")
    return folder(dataset_id)
