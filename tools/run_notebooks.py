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
MAX_BYTES = 300_000  # of a notebook
_BASE64_FILM = re.compile(r"(?<=data:image/webp;base64,)[^\"]+")
_FILM_SIZE = (200, 150)  # width and height of a film in a notebook, pixels
_MAX_CELL_SECONDS = 3600


def select_outputs(cell) -> list:
    """Return the outputs of a cell that the notebook keeps, with smaller films."""
    if cell.source.startswith("%pip"):
        return []
    outputs = [output for output in cell.outputs if output.get("name") != "stderr"]
    for output in outputs:
        data = output.get("data", {})
        if "text/html" in data:
            data["text/html"] = _BASE64_FILM.sub(lambda match: shrink_film(match[0]), data["text/html"])
    return outputs


def shrink_film(film: str) -> str:
    """Return a film, WebP in base64, with every second frame and fewer pixels."""
    image = WebPImageFile(io.BytesIO(base64.b64decode(film)))
    frames = [frame.convert("RGB").resize(_FILM_SIZE) for frame in ImageSequence.Iterator(image)][::2]
    duration = 2 * image.info["duration"]
    buffer = io.BytesIO()
    frames[0].save(buffer, "WEBP", save_all=True, append_images=frames[1:], duration=duration, loop=0, quality=25)
    return base64.b64encode(buffer.getvalue()).decode()


def execute(path: Path) -> str:
    """Return the text of a notebook with the outputs of its cells.

    Raises:
        ValueError: it is too large, or names a folder of this machine.
    """
    import nbformat  # here, as `make notebooks` alone installs them
    from nbclient import NotebookClient

    notebook = nbformat.read(path, as_version=4)
    metadata = notebook.metadata.copy()
    NotebookClient(notebook, timeout=_MAX_CELL_SECONDS, resources={"metadata": {"path": str(path.parent)}}).execute()
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)
        if cell.cell_type == "code":
            cell.outputs = select_outputs(cell)
    notebook.metadata = metadata
    text = nbformat.writes(notebook) + "\n"
    for folder in (ROOT.resolve(), Path.home(), tempfile.gettempdir()):
        if str(folder) in text:
            raise ValueError(f"{path.name}: expected no folder of this machine, got {folder}")
    if len(text) > MAX_BYTES:
        raise ValueError(f"{path.name}: expected at most {MAX_BYTES} bytes, got {len(text)}: show fewer steps")
    return text


def main(name: str = "*") -> None:
    """Run all notebooks, or that of a name, and write each that fits."""
    for path in sorted((ROOT / "examples" / "notebooks").glob(f"{name}.ipynb")):
        path.write_text(execute(path), encoding="utf-8")
        print(path.relative_to(ROOT), path.stat().st_size, "bytes")


if __name__ == "__main__":
    program.run(main)
