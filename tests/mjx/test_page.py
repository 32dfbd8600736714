"""The code of docs/gpu.md runs."""

import pathlib
import re

PAGE = pathlib.Path(__file__).parents[2] / "docs" / "gpu.md"


def test_code():
    blocks, names = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL), {}
    assert len(blocks) == 2
    for block in blocks:
        exec(compile(block, "gpu.md", "exec"), names)
    assert names["actions"].shape == (8, 18)
