"""What no rule of ruff says of the package's and the tools' sources: texts, arrays and XML."""

import ast
import pathlib

import pytest

ROOT = pathlib.Path(__file__).parents[2]
FILES = sorted([*(ROOT / "arc_suite").rglob("*.py"), *(ROOT / "tools").rglob("*.py")])
NO_TEXT = (
    "os.open(",
    "Image.open(",
    "archive.open(",
    "data.open(",
    "Storage.open(",
    "open(dataset_id)",
)  # what opens no text
XML = ("<mujoco", "<body", "<geom", "</")  # PyMJCF builds it, which escapes what a spec says; strings do not


def faults(text):
    """Return the expressions of a source that the suite does without."""
    return [ast.unparse(node) for node in ast.walk(ast.parse(text)) if _is_fault(node)]


def _is_fault(node):
    if isinstance(node, ast.Constant | ast.JoinedStr):
        written = node.value if isinstance(node, ast.Constant) else ast.unparse(node)
        return isinstance(written, str) and any(tag in written for tag in XML)
    if not isinstance(node, ast.Call):
        return False
    call, given = ast.unparse(node.func), {keyword.arg: ast.unparse(keyword.value) for keyword in node.keywords}
    if call in ("np.load", "numpy.load"):
        return given.get("allow_pickle") != "False"
    return call in ("compile", "__import__") or _handles_text(node, given) and "encoding" not in given


def _handles_text(call, given):
    """Whether a call reads or writes text: ruff knows a Path by its annotation alone."""
    name = ast.unparse(call.func).rpartition(".")[2]
    modes = [node.value for node in ast.walk(call) if isinstance(node, ast.Constant)]
    binary = any(isinstance(mode, str) and "b" in mode and set(mode) <= set("abrwx+") for mode in modes)
    opens = name == "open" and not binary and not ast.unparse(call).startswith(NO_TEXT)
    return opens or name in ("read_text", "write_text") or "text" in given


def test_sources_read_files_as_data_and_text_by_its_encoding():
    found = {str(path.relative_to(ROOT)): faults(path.read_text(encoding="utf-8")) for path in FILES}
    assert {path: calls for path, calls in found.items() if calls} == {}


@pytest.mark.parametrize(
    "fault",
    [
        *("open(path)", "path.open('w')", "path.read_text()", "path.write_text('b')", "subprocess.run(a, text=True)"),
        *("np.load('a')", "np.load('a', allow_pickle=True)", "compile(a)", "__import__(a)", "f'<geom name={y}/>'"),
    ],
)
def test_faults_are_found(fault):
    assert fault in faults(f"with files.writing('a') as path:\n    {fault}")
