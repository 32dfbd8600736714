"""Policy files whose header lies: one line that names the file, at once."""

import json

import numpy as np
import pytest

from arc_suite.envs.setup import Setup
from arc_suite.policies import network


@pytest.mark.parametrize(
    "changes",
    [
        {"blocks": {"posture": 10**13}},
        {"blocks": {"posture": 10**30}},
        {"nodes": [["tanh", "observations"]] * 10**5},
        {"nodes": [["tanh", 10**9]]},
        {"nodes": [["tanh"] + ["observations"] * 10**4]},
        {"nodes": 3},
        {"blocks": [1]},
    ],
)
def test_headers(tmp_path, changes):
    header = {**Setup.of("tick").to_dict(), "blocks": {"posture": 4}, "nodes": [["tanh", "observations"]], **changes}
    path = tmp_path / "policy.npz"
    np.savez(path, policy=np.array(json.dumps(header)))
    with pytest.raises(ValueError) as caught:
        network.load(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: no policy, or a damaged one: ") and "\n" not in message and len(message) < 700
