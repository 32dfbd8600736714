"""Notebooks hold what they print and draw, small and without folders of the machine that ran them."""

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
