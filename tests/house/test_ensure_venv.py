"""`make demo` finds a Python that the suite runs on, or says in one line what to install."""

import os
import pathlib
import subprocess

import pytest

SCRIPT = pathlib.Path(__file__).parents[2] / "tools" / "ensure_venv.sh"
PYTHONS = {
    "fits": 'case "$1" in -m) mkdir -p "$4/bin"; echo "$0" > "$4/made_by";; esac; exit 0',
    "3.13": 'case "$1" in -V) echo "Python 3.13.5";; *) exit 1;; esac',
    "broken": "echo no such version >&2; exit 127",
}


@pytest.fixture
def run(tmp_path):
    def run(**pythons):
        for name, kind in pythons.items():
            program = tmp_path / name.replace("_", ".")
            program.write_text(f"#!/bin/sh\n{PYTHONS[kind]}\n")
            program.chmod(0o755)
        for tool in ("mkdir", "dirname"):
            (tmp_path / tool).symlink_to(f"/bin/{tool}")
        venv = tmp_path / "venv"
        done = subprocess.run(
            ["/bin/sh", SCRIPT, venv], env=os.environ | {"PATH": str(tmp_path)}, capture_output=True, text=True
        )
        made_by = pathlib.Path((venv / "made_by").read_text().strip()).name if venv.exists() else None
        return done.returncode, done.stderr, made_by

    return run


@pytest.mark.parametrize(
    ("pythons", "chosen"),
    [
        ({"python3_11": "fits", "python3_12": "fits", "python3": "fits"}, "python3.11"),
        ({"python3_11": "broken", "python3_12": "fits", "python3": "3.13"}, "python3.12"),
        ({"python3_12": "fits"}, "python3.12"),
        ({"python3_12": "broken", "python3": "fits"}, "python3"),
    ],
)
def test_the_first_python_that_fits_is_taken(run, pythons, chosen):
    assert run(**pythons) == (0, "", chosen)


@pytest.mark.parametrize(
    ("pythons", "found"), [({"python3": "3.13", "python3_12": "broken"}, "Python 3.13.5"), ({}, "no Python")]
)
def test_without_one_a_line_says_what_to_install(run, pythons, found):
    status, error, made_by = run(**pythons)
    assert (status, made_by) == (1, None)
    assert error == (
        f"arc_suite needs Python 3.11 or 3.12, found {found}: install one, such as by 'uv python install 3.12', "
        "or see 'Python 3.13' in docs/install.md\n"
    )
