"""Writes the address of the repository into setup.cfg, and wherever the former one stands: pages, notebooks, citation.

README, which names no placeholder, gets a line that clones the repository.

Without an address it prints the present one.

Example:
  python tools/write_address.py https://example.org/maker/arc_suite
"""

import re
from pathlib import Path

from arc_suite.cli import program

ROOT = Path(__file__).resolve().parents[1]
PATTERNS = ("*.md", "docs/*.md", "examples/**/*.md", "examples/notebooks/*.ipynb", "tools/package.md", "CITATION.cff")

_ADDRESS = re.compile(r"^(?:# )?url = (\S+)$", re.MULTILINE)  # a comment while it is a placeholder
_PLACEHOLDER_NOTE = "`example.org` stands for the host until the repository is public. "
_FIRST_COMMAND = "python3 -m venv .venv"  # of README's installation
_VALID = re.compile(r"https://[\w.-]+(/[\w.-]+)+")


def read_address(root: Path = ROOT) -> str:
    """Return the address in setup.cfg.

    Raises:
        ValueError: there is none.
    """
    match = _ADDRESS.search((root / "setup.cfg").read_text(encoding="utf-8"))
    if match is None:
        raise ValueError("setup.cfg: expected a line url = https://...")
    return match[1]


def write_address(address: str, root: Path = ROOT) -> list[Path]:
    """Write an address in place of the former one, and return the files that have changed.

    Raises:
        ValueError: no address of a repository.
    """
    if not _VALID.fullmatch(address) or address.endswith((".git", "/")):
        raise ValueError(f"address {address!r}: expected https://HOST/PATH, without .git or a slash at its end")
    former_address = read_address(root)
    paths = [root / "setup.cfg", *(path for pattern in PATTERNS for path in sorted(root.glob(pattern)))]
    changed_paths = []
    for path in dict.fromkeys(paths):
        text = path.read_text(encoding="utf-8")
        new_text = text.replace(f"# url = {former_address}", f"url = {former_address}").replace(former_address, address)
        new_text = new_text.replace(_PLACEHOLDER_NOTE, "")
        if path == root / "README.md":
            new_text = _with_clone(new_text, address)
        if new_text != text:
            path.write_text(new_text, encoding="utf-8")
            changed_paths.append(path)
    return changed_paths


def _with_clone(readme: str, address: str) -> str:
    """Return the README with a line that clones the repository, before the first command by hand."""
    if f"git clone {address}" in readme:
        return readme
    return readme.replace(_FIRST_COMMAND, f"git clone {address} arc_suite && cd arc_suite\n{_FIRST_COMMAND}", 1)


def main(address: str | None = None) -> None:
    """Write the address, and print the files that have changed."""
    if address is None:
        print(read_address())
        return
    for path in write_address(address):
        print(path.relative_to(ROOT))


if __name__ == "__main__":
    program.run(main)
