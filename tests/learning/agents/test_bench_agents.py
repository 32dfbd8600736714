"""tools/bench_agents.py counts updates of each kind."""

import programs
import pytest

pytest.importorskip("jax", reason="of the extra learn: make check-agents")


@pytest.mark.release
def test_it_prints_a_row_for_each_kind_of_update():
    lines = programs.passed(programs.tool("bench_agents", "--updates", 2)).splitlines()
    assert [line.split()[0] for line in lines[2:]] == ["full,", "full", "critics", "critics"]
    assert all(line.endswith("%") for line in lines[2:])
