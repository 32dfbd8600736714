"""Writes the addresses of the repository and of its site into setup.cfg, pages, notebooks and CITATION.cff.

The former address of the repository gives way wherever it stands. README gets a line that clones the repository, and
README and docs/README.md a link to the page to play on the site. docs/first_steps.md gets links that open the notebooks
in Colab, which reads repositories of GitHub.

Without an address it prints the present one.

Example:
  python tools/write_address.py https://github.com/maker/arc_suite
  python tools/write_address.py https://example.org/maker/arc_suite --site https://arc.example.org
"""

import re
from pathlib import Path

import package_page
from absl import flags

from arc_suite.cli import program

ROOT = Path(__file__).resolve().parents[1]
# README comes first: the text for package indexes is made from it.
PATTERNS = ("*.md", "docs/*.md", "examples/**/*.md", "examples/notebooks/*.ipynb", "tools/package.md", "CITATION.cff")

_ADDRESS = re.compile(r"^(?:# )?url = (\S+)$", re.MULTILINE)  # a comment while it is a placeholder
_PLACEHOLDER_NOTE = "`example.org` stands for the host until the repository is public. "
_FIRST_COMMAND = "python3 -m venv .venv"  # of README's installation
_FIRST_PICTURE = re.compile(r"\A!\[[^\]]*\]\([^)]*\)\n")  # of README
_FIRST_ITEM = "- [Install](install.md)"  # of docs/README.md
_PLAY_LINK = re.compile(r"\[Play in the browser\]\([^)]*\)")
_NOTEBOOK_LINK = re.compile(
    r"(?P<link>\]\(\.\./(?P<path>examples/notebooks/\w+\.ipynb)\))(?:, \[open in Colab\]\([^)]*\))?"
)
_VALID = re.compile(r"https://[\w.-]+(/[\w.-]+)+")
_VALID_SITE = re.compile(r"https://[\w.-]+(/[\w.-]+)*")
_GITHUB = re.compile(r"https://github\.com/(?P<owner>[\w.-]+)/(?P<repository>[\w.-]+)")

FLAGS = flags.FLAGS
flags.DEFINE_string("site", None, "Address of the site. [default: GitHub Pages, of a repository on GitHub]")


def read_address(root: Path = ROOT) -> str:
    """Return the address in setup.cfg.

    Raises:
        ValueError: there is none.
    """
    match = _ADDRESS.search((root / "setup.cfg").read_text(encoding="utf-8"))
    if match is None:
        raise ValueError("setup.cfg: expected a line url = https://...")
    return match[1]


def default_site(address: str) -> str | None:
    """Return the address at which GitHub Pages publish a repository, or None if it is not on GitHub."""
    match = _GITHUB.fullmatch(address)
    return f"https://{match['owner']}.github.io/{match['repository']}" if match else None


def write_address(address: str, root: Path = ROOT, site: str | None = None) -> list[Path]:
    """Write an address in place of the former one, and return the files that have changed.

    Args:
        address: of the repository.
        root: folder of the repository.
        site: address of the site. [default: `default_site`; without one, links to the site stay as they are]

    Raises:
        ValueError: no address of a repository, or of a site.
    """
    if not _VALID.fullmatch(address) or address.endswith((".git", "/")):
        raise ValueError(f"address {address!r}: expected https://HOST/PATH, without .git or a slash at its end")
    if site is not None and not _VALID_SITE.fullmatch(site):
        raise ValueError(f"site {site!r}: expected https://HOST or https://HOST/PATH, without a slash at its end")
    site = site or default_site(address)
    former_address = read_address(root)
    paths = [root / "setup.cfg", *(path for pattern in PATTERNS for path in sorted(root.glob(pattern)))]
    changed_paths = []
    for path in dict.fromkeys(paths):
        text = path.read_text(encoding="utf-8")
        new_text = _replace_address(text, former_address, address)
        match path.relative_to(root).as_posix():
            case "README.md":
                new_text = _add_play_link(_add_clone(new_text, address), site)
            case "docs/README.md":
                new_text = _add_play_item(new_text, site)
            case "docs/first_steps.md":
                new_text = _add_colab_links(new_text, address)
            case "tools/package.md":
                new_text = package_page.page((root / "README.md").read_text(encoding="utf-8"))
        if new_text != text:
            path.write_text(new_text, encoding="utf-8")
            changed_paths.append(path)
    return changed_paths


def _replace_address(text: str, former_address: str, address: str) -> str:
    """Return a text with the new address; a line that was a comment while the address was a placeholder is none."""
    for key in ("url = ", "repository-code: "):
        text = text.replace(f"# {key}{former_address}", f"{key}{former_address}")
    return text.replace(former_address, address).replace(_PLACEHOLDER_NOTE, "")


def _add_clone(readme: str, address: str) -> str:
    """Return the README with a line that clones the repository, before the first command by hand."""
    if f"git clone {address}" in readme:
        return readme
    return readme.replace(_FIRST_COMMAND, f"git clone {address} arc_suite && cd arc_suite\n{_FIRST_COMMAND}", 1)


def _add_play_link(readme: str, site: str | None) -> str:
    """Return the README with a link to the page to play, below its first picture."""
    if site is None:
        return readme
    link = f"[Play in the browser]({site}/play.html)"
    if _PLAY_LINK.search(readme):
        return _PLAY_LINK.sub(link, readme)
    return _FIRST_PICTURE.sub(lambda picture: f"{picture[0]}\n{link}\n", readme)


def _add_play_item(index: str, site: str | None) -> str:
    """Return the list of pages with the page to play as its first item."""
    if site is None:
        return index
    link = f"[Play in the browser]({site}/play.html)"
    if _PLAY_LINK.search(index):
        return _PLAY_LINK.sub(link, index)
    return index.replace(_FIRST_ITEM, f"- {link}: no installation.\n{_FIRST_ITEM}", 1)


def _add_colab_links(page: str, address: str) -> str:
    """Return a page in which each link to a notebook has one to Colab next to it, if the repository is on GitHub."""
    repository = _GITHUB.fullmatch(address)

    def add_link(notebook: re.Match) -> str:
        if repository is None:
            return notebook["link"]
        place = f"github/{repository['owner']}/{repository['repository']}/blob/main/{notebook['path']}"
        return f"{notebook['link']}, [open in Colab](https://colab.research.google.com/{place})"

    return _NOTEBOOK_LINK.sub(add_link, page)


def main(address: str | None = None) -> None:
    """Write the address, and print the files that have changed."""
    if address is None:
        print(read_address())
        return
    for path in write_address(address, site=FLAGS.site):
        print(path.relative_to(ROOT))


if __name__ == "__main__":
    program.run(main)
