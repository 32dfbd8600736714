"""The packages on which results depend, and the line that says how to get them."""

import contextlib
import sys
from pathlib import Path

# As in setup.cfg. MuJoCo and dm_control move together.
REQUIREMENTS = {"mujoco": ">=3.17,<3.18", "dm-control": "==1.0.50", "gymnasium": ">=1.2,<1.5", "shimmy": "==2.0.1"}


def clone_folder() -> Path | None:
    """Return the folder of the clone that this package lies in; None for an installed package."""
    folder = Path(__file__).parents[1]
    return folder if (folder / "setup.cfg").exists() else None


class MissingExtra(ImportError, ValueError):
    """An extra of the suite is not installed; in a clone the message gives the command that installs it."""

    def __init__(self, need: str, extra: str, error: ImportError):
        """Name the extra.

        Args:
            need: what needs which package, such as "ONNX needs onnx".
            extra: of setup.cfg.
            error: of the import that failed.
        """
        # Outside a clone nobody knows where the package came from: no index has it.
        remedy = (
            f"pip install -e '{clone_folder()}[{extra}]'"
            if clone_folder()
            else f"install arc_suite with the extra {extra!r}"
        )
        super().__init__(f"{need}: {remedy} ({error})")


@contextlib.contextmanager
def require_extra(need: str, extra: str):
    """Name the extra that is missing where imports in this context fail.

    Args:
        need: what needs which package, such as "ONNX needs onnx".
        extra: of setup.cfg.

    Raises:
        MissingExtra: in place of another ImportError.
    """
    try:
        yield
    except ImportError as error:
        raise MissingExtra(need, extra, error) from None


def version_of(package: str) -> str | None:
    """Return the version of an installed package; None for one that is not installed."""
    from importlib import metadata  # slow to import, and seldom needed

    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


def dependency_versions() -> dict[str, str | None]:
    """Return the versions of what results depend on, by package; None for one that is not installed."""
    return {name: version_of(name) for name in ("arc_suite", "mujoco", "dm_control", "numpy")}


def problems() -> list[str]:
    """Return a line with the remedy for every package that is missing or has a version that does not fit."""
    from packaging.specifiers import SpecifierSet

    lines = []
    for package, needed in REQUIREMENTS.items():
        version = version_of(package)
        if version is None or not SpecifierSet(needed).contains(version, prereleases=True):
            wrong = f"{package} is {version or 'not installed'} and should be {needed}"
            # From Python 3.13 on a package that dm_control asks for cannot be installed; nothing here uses it.
            alone = "--no-deps " if package == "dm-control" and sys.version_info >= (3, 13) else ""
            lines.append(f"{wrong}: pip install {alone}'{package}{needed}'")
    return lines


@contextlib.contextmanager
def explain_import_errors():
    """Name the package that is to blame, in one line, where imports in this context fail.

    Raises:
        ImportError: instead of what was raised, if a package is missing or has another version.
    """
    try:
        yield
    except Exception as error:
        if wrong := problems():
            raise ImportError(f"cannot import arc_suite: {'; '.join(wrong)}") from error
        raise
