"""The list of planted mistakes fits the code; `make mutants` tries them."""

import mutants
import pytest


@pytest.mark.parametrize("mutant", mutants.MUTANTS, ids=lambda mutant: mutant.mistake)
def test_mistake_can_be_planted(mutant):
    text = (mutants.ROOT / "arc_suite" / mutant.file).read_text()
    assert text.count(mutant.old) == 1
    compile(text.replace(mutant.old, mutant.new), mutant.file, "exec")
