"""The address of the repository stands in setup.cfg, and pages and notebooks have the same one."""

import json
import re
import shutil

import package_page
import pytest
import write_address
from website import players

ROOT = write_address.ROOT
ADDRESS = write_address.read_address()
NEW = "https://code.example.net/walkers/legs"


def test_readme_gets_one_line_that_clones(tmp_path):
    for name in ("setup.cfg", "README.md"):
        shutil.copy(ROOT / name, tmp_path / name)
    for address in (NEW, f"{NEW}-2"):
        write_address.write_address(address, tmp_path)
        text = (tmp_path / "README.md").read_text()
        assert text.count("git clone ") == 1
        assert f"```sh\ngit clone {address} arc_suite && cd arc_suite\npython3 -m venv .venv" in text


def test_pages_get_one_link_to_play_and_notebooks_links_to_colab(tmp_path):
    pages = ("README.md", "docs/README.md", "docs/first_steps.md", "tools/package.md")
    for name in ("setup.cfg", *pages):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    sites = {
        "https://github.com/walkers/legs": "https://walkers.github.io/legs",
        "https://github.com/walkers/feet": "https://feet.example.net",
        NEW: "https://example.net/docs",
    }
    for address, site in sites.items():
        is_default = site == write_address.default_site(address)
        write_address.write_address(address, tmp_path, site=None if is_default else site)
        readme, index, first_steps, package = ((tmp_path / name).read_text() for name in pages)
        for text in (readme, index, package):
            assert re.findall(r"\[Play in the browser\]\((.*)\)", text) == [f"{site}/play.html"]
        assert package == package_page.page(readme)
        notebooks = {path.name for path in (ROOT / "examples" / "notebooks").glob("*.ipynb")}
        colab = address.replace("https://github.com", "https://colab.research.google.com/github")
        opened = re.findall(r"\[open in Colab\]\((.*?)/blob/main/examples/notebooks/(.*?)\)", first_steps)
        assert set(opened) == ({(colab, name) for name in notebooks} if "github.com" in address else set())


def test_without_a_site_there_is_no_link_to_play(tmp_path):
    for name in ("setup.cfg", "README.md"):
        shutil.copy(ROOT / name, tmp_path / name)
    write_address.write_address(NEW, tmp_path)
    assert "Play in the browser" not in (tmp_path / "README.md").read_text()
    with pytest.raises(ValueError, match="^site 'example.org': expected https://HOST"):
        write_address.write_address(NEW, tmp_path, site="example.org")


def test_the_page_to_play_has_the_name_that_the_site_gives_it():
    assert players.GAME == "play.html"


def test_an_address_is_written_wherever_the_former_one_stands(tmp_path):
    for name in ("setup.cfg", "docs/install.md", "CITATION.cff", "examples/notebooks/first_steps.ipynb"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    (tmp_path / "docs" / "faq.md").write_text("No address.")
    changed = write_address.write_address(NEW, tmp_path)
    names = [path.relative_to(tmp_path).as_posix() for path in changed]
    assert names == ["setup.cfg", "docs/install.md", "examples/notebooks/first_steps.ipynb", "CITATION.cff"]
    assert f"\nrepository-code: {NEW}\n" in (tmp_path / "CITATION.cff").read_text()
    assert write_address.read_address(tmp_path) == NEW
    assert f"git clone {NEW} arc_suite && cd arc_suite" in (tmp_path / "docs/install.md").read_text()
    assert all("example.org" not in path.read_text() for path in changed)
    json.loads((tmp_path / names[2]).read_text())


@pytest.mark.parametrize(
    "address", ["", "example.org/a/b", "https://example.org", "https://x.org/a/b.git", "https://x.org/a/"]
)
def test_what_is_no_address_is_one_line(address, tmp_path):
    with pytest.raises(ValueError, match="^address .*: expected https://HOST/PATH"):
        write_address.write_address(address, tmp_path)


def test_the_page_on_installing_and_notebooks_name_the_address():
    """The text for package indexes has no clone."""
    assert f"git clone {ADDRESS} arc_suite" in (ROOT / "docs/install.md").read_text(encoding="utf-8")
    assert ADDRESS not in package_page.PAGE.read_text(encoding="utf-8")
    for path in (ROOT / "examples" / "notebooks").glob("*.ipynb"):
        first = next(cell for cell in json.loads(path.read_text())["cells"] if cell["cell_type"] == "code")
        source = "".join(first["source"])
        assert f'@git+{ADDRESS}"' in source and '"-e ../..[' in source
