"""The journal of a search."""

import pytest
from preset_search import Generation

from arc_suite.journal import Journal

SETTINGS = {"robot": "bastion", "seed": 3, "episodes": 2, "steps": 12, "starts": 8}
GENERATIONS = [Generation([1.0, 2.0], 2.0, 0.0, [0.5, 0.25]), Generation([1.5, 3.0], 3.0, 0.5, [1.0, 1.0])]


def test_journal_keeps_what_was_written_when_broken_off(tmp_path):
    path = tmp_path / "journal.jsonl"
    journal = Journal(path, SETTINGS, Generation)
    for generation in GENERATIONS:
        journal.append(generation)
    whole = path.read_bytes()
    with pytest.raises(ValueError, match="journal.jsonl: another process goes on with this search$"):
        Journal(path, SETTINGS, Generation)
    journal.close()
    for cut in range(len(whole) + 1):
        path.write_bytes(whole[:cut])
        again = Journal(path, SETTINGS, Generation)
        assert again.generations == GENERATIONS[: max(whole[:cut].count(b"\n") - 1, 0)]
        for generation in GENERATIONS[len(again.generations) :]:
            again.append(generation)
        again.close()
        assert path.read_bytes() == whole


def test_a_journal_of_something_else_is_refused_and_left_alone(tmp_path):
    path = tmp_path / "journal.jsonl"
    journal = Journal(path, SETTINGS, Generation)
    journal.append(GENERATIONS[0])
    journal.close()
    whole = path.read_bytes()
    with pytest.raises(ValueError, match=r"of a search with seed 3, not 4; delete it or write to another folder$"):
        Journal(path, SETTINGS | {"seed": 4}, Generation)
    assert path.read_bytes() == whole
    for text in ("notes\n", "[]\n", '{"robot": "bastion"}\n', whole.decode() + "notes\n", whole.decode() + "{}\n"):
        path.write_text(text)
        with pytest.raises(ValueError, match=r"^.*journal.jsonl: no journal of a search: .*; delete it or write"):
            Journal(path, SETTINGS, Generation)
        assert path.read_text() == text
