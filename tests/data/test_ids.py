"""Ids of datasets."""

import minari
import pytest
from datasets import ID, QUEEN, SHORT, collect

from arc_suite import data
from arc_suite.data import ids


def test_unknown_ids():
    with pytest.raises(ValueError, match=f"^unknown dataset '{ID}': there are none in "):
        data.open(ID)
    collect(ID, data.DatasetSettings(QUEEN, **SHORT), 1)
    with pytest.raises(ValueError) as error:
        data.open("arc_suite/test/same-v0")
    assert str(error.value) == f"unknown dataset 'arc_suite/test/same-v0'; did you mean {ID!r}? (there are: {ID})"
    other = "arc_suite/queen/walk/cpg-medium-v0"
    for wrong, example in (
        (ID[:-3], ID),
        (f"{ID}/inner-v0", other),
        ("../some-v0", other),
        ("a/b-v0", other),
        ("", other),
    ):
        with pytest.raises(ValueError) as error:
            data.open(wrong)
        assert str(error.value) == (
            f"dataset id {wrong!r}: expected names of letters, digits, '-' and '_' with '/' between, two "
            f"characters at least before the last '/', and a version at the end alone, such as {example!r}"
        )


def test_names_of_one_letter():
    for dataset_id in ("a-v0", "ab/c-v0", "a/b/c-v0"):
        collect(dataset_id, data.DatasetSettings(QUEEN, **SHORT), 1)
        assert len(data.open(dataset_id)) == len(minari.load_dataset(dataset_id)) == 1
    assert set(ids.existing()) == {"a-v0", "a/b/c-v0", "ab/c-v0"}
