"""SIGTERM in work that can be resumed."""

import os
import signal

import pytest

from arc_suite.cli import program


def test_sigterm_is_one_line_and_143(capsys):
    before = signal.getsignal(signal.SIGTERM)

    def work():
        with program.resumable("runs/here"):
            os.kill(os.getpid(), signal.SIGTERM)

    with pytest.raises(SystemExit) as ended:
        program.guard(work, "arc-suite study")
    assert ended.value.code == 143
    assert capsys.readouterr().err == "arc-suite study: interrupted; the same command resumes runs/here\n"
    assert signal.getsignal(signal.SIGTERM) == before


def test_sigterm_can_be_asked_for():
    with program.termination() as came:
        assert not came()
        os.kill(os.getpid(), signal.SIGTERM)
        assert came()
