"""Rows of the episodes that judge a policy."""

from arc_suite.evaluation import EpisodeResult
from arc_suite.learning import finals


def test_no_metric_takes_the_place_of_another_value():
    """Names of metrics are checked at the first control step alone, and a metric may come later."""
    names = {"policy_sha256": 1.0, "seed": 2.0, "return": 3.0, "length": 4.0, "speed": 0.5}
    (line,) = finals.to_lines("abc", [7], [EpisodeResult(total=10.0, length=5, progress=names)])
    assert line == {"policy_sha256": "abc", "seed": "7", "return": "10.0", "length": "5", "speed": "0.5"}
    assert list(line) == ["policy_sha256", "seed", "return", "length", "speed"]
