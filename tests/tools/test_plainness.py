"""The tool that finds names and statements that make a reader stop."""

import subprocess

import plainness
import programs
import pytest

PLAIN = """
class Motion:
    @property
    def mirrored(self):
        return self

    def has_started(self):
        first, last = self.ends()
        first, last = last, first
        return first

    def feed(self):
        return [foot for foot in self.feet]
"""
HARD = """
def moved(body):
    x, y = body.x, 0.0
    found = [each for each in body.legs]
    return found

def legs_told():
    (own := 1)
"""
LINES = [
    ("parallel assignment", 3, "x, y = body.x, 0.0"),
    ("participle", 2, "moved"),
    ("participle", 7, "legs_told"),
    ("vague local", 4, "found"),
    ("vague local", 4, "each"),
    ("vague local", 8, "own"),
]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "arc_suite").mkdir()
    (tmp_path / "arc_suite/plain.py").write_text(PLAIN)
    return tmp_path


def test_what_is_plain_and_what_is_not(folder):
    assert plainness.find_in_files([folder]) == []
    (folder / "arc_suite/hard.py").write_text(HARD)
    findings = plainness.find_in_files([folder])
    assert sorted((finding.kind, finding.line, finding.text) for finding in findings) == sorted(LINES)


def test_lines_that_a_change_adds(folder):
    git = ["git", "-c", "user.name=A", "-c", "user.email=a@b.c"]
    for command in (["init", "-q"], ["add", "."], ["commit", "-qm", "Plain"]):
        subprocess.run([*git, *command], check=True)
    (folder / "arc_suite/plain.py").write_text(PLAIN + HARD)
    (folder / "arc_suite/new.py").write_text("")
    lines = programs.tool("plainness", "--change", "HEAD", cwd=folder).stdout.splitlines()
    assert len(lines) == len(LINES) and lines[-1].startswith("arc_suite/plain.py:")
    programs.refused(
        programs.tool("plainness", "--change", "nothing", cwd=folder),
        "plainness: git cannot compare with nothing: fatal: bad revision 'nothing'",
    )


def test_errors(folder):
    programs.refused(programs.tool("plainness", "missing", cwd=folder), "plainness: missing: no such file or folder\n")
    (folder / "arc_suite/broken.py").write_text("def")
    programs.refused(programs.tool("plainness", "arc_suite", cwd=folder), "plainness: arc_suite/broken.py: invalid")
