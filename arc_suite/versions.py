"""The packages on which results depend, and the line that says how to get them."""

import contextlib
import functools
import hashlib
import subprocess
import sys
import sysconfig
import traceback
from pathlib import Path

# As in setup.cfg. A new MuJoCo needs a new dm_control.
REQUIREMENTS = {"mujoco": ">=3.17,<3.18", "dm-control": "==1.0.50", "gymnasium": ">=1.2,<1.5", "shimmy": "==2.0.1"}

# Packages that the suite imports, or that those import; `gym` is of shimmy.
_IMPORTED_PACKAGES = ("absl", "dm_control", "dm_env", "gym", "gymnasium", "mujoco", "numpy", "shimmy", "tqdm")

_RECORDED_PACKAGES = ("arc_suite", "mujoco", "dm_control", "numpy")
_TIMEOUT = 10.0  # s, of git


def clone_folder() -> Path | None:
    """Return the folder of the repository's clone that contains this package; None for an installed package."""
    folder = Path(__file__).parents[1]
    return folder if (folder / "setup.cfg").exists() else None


@functools.cache
def commit_of_clone() -> str | None:
    """Return the commit of the clone, with "-dirty" where files differ from it; None without a clone or without git."""
    folder = clone_folder()
    if folder is None or not (folder / ".git").exists():
        return None
    command = ["git", "-C", str(folder), "describe", "--always", "--dirty", "--exclude=*"]
    try:
        result = subprocess.run(command, capture_output=True, encoding="utf-8", timeout=_TIMEOUT)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return result.stdout.strip() if result.returncode == 0 else None


class MissingExtra(ImportError, ValueError):
    """An extra of the suite is not installed; in a clone the message gives the command that installs it."""

    def __init__(self, need: str, extra: str, error: ImportError):
        """Word the message.

        Args:
            need: what needs which package, such as "ONNX needs onnx".
            extra: name of the extra in setup.cfg.
            error: error of the import that failed.
        """
        folder = clone_folder()
        if folder is None:  # the package may come from anywhere: no package index has it
            remedy = f"install arc_suite with the extra {extra!r}"
        else:
            remedy = f"pip install -e '{folder}[{extra}]'"
        super().__init__(f"{need}: {remedy} ({error})")


@contextlib.contextmanager
def require_extra(need: str, extra: str):
    """Turn an ImportError in this context into an error that names the missing extra.

    Args:
        need: what needs which package, such as "ONNX needs onnx".
        extra: name of the extra in setup.cfg.

    Raises:
        MissingExtra: in place of another ImportError.
    """
    try:
        yield
    except ImportError as error:
        raise MissingExtra(need, extra, error) from None


def version_of(package: str) -> str | None:
    """Return the version of an installed package; None for one that is not installed."""
    from importlib import metadata  # imported here, as it is slow to import and seldom needed

    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


def dependency_versions() -> dict[str, str | None]:
    """Return the versions of the suite and of what its results depend on, by package; None if not installed."""
    return {package: version_of(package) for package in _RECORDED_PACKAGES}


def describe_module(module: str) -> str | None:
    """Return the distribution that holds a module, with its version, if any does, and the SHA-256 of its file.

    Args:
        module: dotted name.

    Returns:
        Text such as "legs-kit 1.0, sha256 ab12..."; None for a module without a file.
    """
    from importlib import metadata  # imported here, as above

    path = getattr(sys.modules.get(module), "__file__", None)
    if path is None or not Path(path).is_file():
        return None
    words = []
    package, _, _ = module.partition(".")
    for distribution in metadata.packages_distributions().get(package, ())[:1]:
        words.append(f"{distribution} {metadata.version(distribution)}")
    words.append(f"sha256 {hashlib.sha256(Path(path).read_bytes()).hexdigest()}")
    return ", ".join(words)


def problems() -> list[str]:
    """Return a line for every required package that is missing or has a wrong version; it contains the remedy."""
    from packaging.specifiers import SpecifierSet

    lines = []
    for package, requirement in REQUIREMENTS.items():
        version = version_of(package)
        if version is not None and SpecifierSet(requirement).contains(version, prereleases=True):
            continue
        problem = f"{package} is {version or 'not installed'} and should be {requirement}"
        # From Python 3.13 on, one dependency of dm_control cannot be installed; the suite does not use it.
        option = "--no-deps " if package == "dm-control" and sys.version_info >= (3, 13) else ""
        lines.append(f"{problem}: pip install {option}'{package}{requirement}'")
    return lines


def _hiding_files(error: Exception) -> list[str]:
    """Return a line for every file of the user that hides a package of the same name, and led to an error."""
    library_folders = {sysconfig.get_path(name) for name in ("stdlib", "platstdlib", "purelib", "platlib")}
    imported_files = {getattr(sys.modules.get(name), "__file__", None) for name in _IMPORTED_PACKAGES}
    traceback_text = "".join(traceback.format_exception(error))
    lines = []
    for folder in dict.fromkeys((Path(sys.path[0] or ".").absolute(), Path.cwd())):
        for name in (*_IMPORTED_PACKAGES, *sys.stdlib_module_names):
            for file in (folder / f"{name}.py", folder / name / "__init__.py"):
                is_of_library = bool(library_folders & {str(parent) for parent in file.parents})
                led_to_error = str(file) in imported_files or f'"{file}"' in traceback_text
                if led_to_error and not is_of_library:
                    lines.append(f"{file} hides a package of the same name: rename it")
    return list(dict.fromkeys(lines))


@contextlib.contextmanager
def explain_import_errors():
    """Turn an error in this context into one line that names its cause in the surroundings.

    It names packages that are missing or have a wrong version, and the user's own files that hide a package.

    Raises:
        ImportError: in place of the error, if there is such a cause.
    """
    try:
        yield
    except Exception as error:
        lines = [*_hiding_files(error), *problems()]
        if lines:
            raise ImportError(f"cannot import arc_suite: {'; '.join(lines)}") from error
        raise
