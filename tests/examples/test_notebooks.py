"""Notebooks hold what they print and draw, small and without folders of the machine that ran them."""

import configparser
import json
import pathlib
import re

import pytest
import run_notebooks

NOTEBOOKS = sorted((run_notebooks.ROOT / "examples" / "notebooks").glob("*.ipynb"))
FOLDER = re.compile(r"(?<![\w.<])/(?:home|root|tmp|Users|var|work)/|[A-Z]:\\\\")


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_shows_what_it_does(path: pathlib.Path):
    text = path.read_text(encoding="utf-8")
    assert len(text) <= run_notebooks.MAX_BYTES
    cells = [cell for cell in json.loads(text)["cells"] if cell["cell_type"] == "code"]
    shown = [output for cell in cells for output in cell["outputs"]]
    assert not any(output["output_type"] == "error" for output in shown)
    pictures = "".join(str(output.get("data", "")) for output in shown)
    assert "image/png" in pictures or "image/webp" in pictures, f"{path.name} shows nothing: make notebooks"
    assert FOLDER.findall("".join(str(output.get("text", "")) for output in shown)) == []


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_the_first_cell_installs_dm_control_where_labmaze_has_no_wheel(path: pathlib.Path):
    config = configparser.ConfigParser()
    config.read(run_notebooks.ROOT / "setup.cfg")
    (pinned,) = re.findall(r"^(dm-control==\S*);", config["options"]["install_requires"], re.MULTILINE)
    first = next(cell for cell in json.loads(path.read_text())["cells"] if cell["cell_type"] == "code")
    assert "if sys.version_info >= (3, 13):" in "".join(first["source"])
    assert f"    %pip install -q --no-deps {pinned}\n" in first["source"]
