"""What tests of datasets share: a short walk, and collecting and verifying without progress bars."""

import functools

from tqdm import tqdm

from arc_suite import data
from arc_suite.robots import ROBOTS

QUEEN, TICK = ROBOTS["queen"], ROBOTS["tick"]
ID = "arc_suite/test/some-v0"
SHORT = {"seed": 5, "steps": 20}

quiet = functools.partial(tqdm, disable=True)
collect = functools.partial(data.collect, progress=quiet)
verify = functools.partial(data.verify, progress=quiet)


def digests(dataset_id=ID):
    return [summary["sha256"] for summary in data.open(dataset_id).summaries()]
