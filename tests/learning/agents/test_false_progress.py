"""A checkpoint that claims evaluations which there are none of is refused, as all others would be left out."""

import pytest

from arc_suite.learning.agents import run_folder


def test_evaluated_is_that_of_the_table(tmp_path):
    run_folder.check_evaluated(tmp_path, 0)
    (tmp_path / "evaluations.csv").write_text("step,seed,return\n100,0,1.5\n200,0,2.5\n")
    run_folder.check_evaluated(tmp_path, 200)
    with pytest.raises(ValueError) as caught:
        run_folder.check_evaluated(tmp_path, 10**9)
    assert str(caught.value) == (
        f"{tmp_path / 'checkpoint.npz'} is damaged: evaluated: expected 200, as in evaluations.csv, got 1000000000; "
        "delete it to start the run over"
    )
