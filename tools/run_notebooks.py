"""Runs the notebooks of examples/notebooks and keeps what they print and draw, for readers who do not run them.

What belongs to this machine does not stay: paths are refused, and progress and the output of pip are left out.

Example:
  python tools/run_notebooks.py
  python tools/run_notebooks.py first_steps
"""

import base64
import io
import re
import tempfile
from pathlib import Path

from PIL import ImageSequence
from PIL.WebPImagePlugin import WebPImageFile

from arc_suite.cli import program

ROOT = Path(__file__).parents[1]
MOST = 300_000  # bytes of a notebook
_FILM = re.compile(r"(?<=data:image/webp;base64,)[^\"]+")
_SIZE = (200, 150)  # of a film that stays, in pixels
_SECONDS = 3600  # of a cell, at most


def kept(cell) -> list:
    """Return the outputs of a cell that stay."""
    if cell.source.startswith("%pip"):
        return []
    outputs = [output for output in cell.outputs if output.get("name") != "stderr"]
    for output in outputs:
        for kind, data in output.get("data", {}).items():
            output["data"][kind] = _FILM.sub(lambda found: smaller(found[0]), data) if kind == "text/html" else data
    return outputs


def smaller(film: str) -> str:
    """Return a film, WebP in base64, with every second frame, of fewer pixels."""
    image, found = WebPImageFile(io.BytesIO(base64.b64decode(film))), io.BytesIO()
    first, *others = [frame.convert("RGB").resize(_SIZE) for frame in ImageSequence.Iterator(image)][::2]
    duration = 2 * image.info["duration"]
    first.save(found, "WEBP", save_all=True, append_images=others, duration=duration, loop=0, quality=25)
    return base64.b64encode(found.getvalue()).decode()


def executed(path: Path) -> str:
    """Return a notebook with the outputs of its cells.

    Raises:
        ValueError: it is too large, or names a folder of this machine.
    """
    import nbformat  # here, as `make notebooks` alone installs them
    from nbclient import NotebookClient

    notebook = nbformat.read(path, as_version=4)
    metadata = notebook.metadata.copy()
    NotebookClient(notebook, timeout=_SECONDS, resources={"metadata": {"path": str(path.parent)}}).execute()
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)
        if cell.cell_type == "code":
            cell.outputs = kept(cell)
    notebook.metadata = metadata
    text = nbformat.writes(notebook) + "\n"
    found = [place for place in map(str, (ROOT.resolve(), Path.home(), tempfile.gettempdir())) if place in text]
    if found:
        raise ValueError(f"{path.name}: expected no folder of this machine, got {found[0]}")
    if len(text) > MOST:
        raise ValueError(f"{path.name}: expected at most {MOST} bytes, got {len(text)}: show fewer steps")
    return text


def main(name: str = "*") -> None:
    """Run all notebooks, or that of a name, and write each that fits."""
    for path in sorted((ROOT / "examples" / "notebooks").glob(f"{name}.ipynb")):
        path.write_text(executed(path), encoding="utf-8")
        print(path.relative_to(ROOT), path.stat().st_size, "bytes")


if __name__ == "__main__":
    program.run(main)
