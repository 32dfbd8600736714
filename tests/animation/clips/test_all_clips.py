"""Every clip, of one of ten bodies: it keeps to its bounds or is left out with a line; `check-clip-sets` has all."""

import clip_sets
import pytest

from arc_suite.animation.clips.catalog import CLIPS
from arc_suite.animation.clips.drafts import make_drafts

LEFT_OUT_OF_BODY = {
    "queen": {},
    "bastion": {"leap": "it does not land on its feet"},
    "tick": {},
    "leaper": {},
    "hound": {},
    "spider": {"tuned": "spider has no preset tuned"},
    "random_1": {"refined": "random_1 has no preset refined"},
    "random_2": {"get_up": "it does not get up from its back within 4 s"},
    "random_6": {"get_up_side": "it does not get up from its side within 4 s"},  # it does among the falls of more drops
    "random_8": {},
}


@pytest.mark.slow
@pytest.mark.parametrize("name", LEFT_OUT_OF_BODY)
def test_clips_keep_to_bounds_or_are_left_out(name):
    first = list(LEFT_OUT_OF_BODY).index(name)
    clips = list(CLIPS)[first :: len(LEFT_OUT_OF_BODY)]
    body = clip_sets.load_body(name)
    left_out = {}
    drafts = make_drafts(clip_sets.make_recorder(body), clips, iter, left_out)
    assert {clip: left_out[clip] for clip in clips if clip in left_out} == LEFT_OUT_OF_BODY[name]
    assert clip_sets.broken(body, {clip: drafts[clip] for clip in clips if clip not in left_out}) == {}
