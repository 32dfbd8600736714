"""Ids of datasets."""

import pwd

import minari
import pytest
from datasets import ID, QUEEN, SHORT, collect
from refusals import refused

from arc_suite import data
from arc_suite.data import ids


def test_unknown_ids():
    with pytest.raises(ValueError, match=f"^unknown dataset '{ID}': there are none in "):
        data.open(ID)
    collect(ID, data.DatasetSettings(QUEEN, **SHORT), 1)
    with refused(f"unknown dataset 'arc_suite/test/same-v0'; did you mean {ID!r}? (there are: {ID})"):
        data.open("arc_suite/test/same-v0")
    names = "names of letters, digits, '-' and '_' with '/' between, two characters at least before the last '/'"
    for wrong in (ID[:-3], f"{ID}/inner-v0", "../some-v0", "a/b-v0", ""):
        example = ID if wrong == ID[:-3] else "arc_suite/queen/walk/cpg-medium-v0"
        line = f"expected {names}, and a version at the end alone, such as {example!r}"
        with refused(f"dataset id {wrong!r}: {line}"):
            data.open(wrong)


@pytest.mark.parametrize("home", ["/proc/none", None])
def test_without_a_home_one_line_names_the_variable(home, monkeypatch):
    def find_no_user(uid):
        raise KeyError(f"getpwuid(): uid not found: {uid}")

    monkeypatch.delenv("MINARI_DATASETS_PATH")
    monkeypatch.setattr(pwd, "getpwuid", find_no_user)
    monkeypatch.setenv("HOME", home) if home else monkeypatch.delenv("HOME")
    for use in (lambda: data.open(ID), lambda: collect(ID, data.DatasetSettings(QUEEN, **SHORT), 1), ids.existing):
        with pytest.raises(OSError, match=r"folder of datasets: .*; set MINARI_DATASETS_PATH to another folder$"):
            use()


def test_names_of_one_letter():
    for dataset_id in ("a-v0", "ab/c-v0", "a/b/c-v0"):
        collect(dataset_id, data.DatasetSettings(QUEEN, **SHORT), 1)
        assert len(data.open(dataset_id)) == len(minari.load_dataset(dataset_id)) == 1
    assert set(ids.existing()) == {"a-v0", "a/b/c-v0", "ab/c-v0"}
