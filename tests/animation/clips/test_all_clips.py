"""Every clip, of one of ten bodies: it keeps to its bounds or is left out with a line; `check-clip-sets` has all."""

import clip_sets
import pytest

from arc_suite.animation.clips.catalog import CLIPS
from arc_suite.animation.clips.drafts import make_drafts

# Clips that are left out, and the beginning of the line that says why; one of two where processors differ by a bit.
LEFT_OUT_OF_BODY = {
    "leaper": {
        "strafe_left": ("the pose does not return within 2 degrees: ", "torso or legs are 0.03"),
        "jump": "its feet come down 0.14 standing heights from where they stood, more than 0.1",
    },
    "bastion": {"leap": "it does not land on its feet"},
    "tick": {},
    "queen": {},
    "hound": {},
    "spider": {"tuned": "spider has no preset tuned"},
    "random_14": {
        "limp": "the pose does not return within 2 degrees: 2.4 after 1 cycles",
        "refined": "random_14 has no preset refined",
    },
    "random_21": {"get_up": "it does not get up from its back within 4 s"},
    "random_23": {"get_up_side": "it does not get up from its side within 4 s"},
    "random_27": {},
}


@pytest.mark.slow
@pytest.mark.parametrize("name", LEFT_OUT_OF_BODY)
def test_clips_keep_to_bounds_or_are_left_out(name):
    first = list(LEFT_OUT_OF_BODY).index(name)
    clips = list(CLIPS)[first :: len(LEFT_OUT_OF_BODY)]
    body = clip_sets.load_body(name)
    left_out = {}
    drafts = make_drafts(clip_sets.make_recorder(body), clips, iter, left_out)
    assert left_out.keys() & set(clips) == LEFT_OUT_OF_BODY[name].keys()
    for clip, line in LEFT_OUT_OF_BODY[name].items():
        assert left_out[clip].startswith(line)
    assert clip_sets.broken(body, {clip: drafts[clip] for clip in clips if clip not in left_out}) == {}
