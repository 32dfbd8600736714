"""The film of README: cuts of views, and of a hand in a page, one after the other."""

from collections.abc import Iterator, Mapping

import numpy as np

from arc_suite.bodies import generator
from media import hand, stage
from media.hand import Hand
from media.views import Look, View

_DAY = Look(shadows=8192)
_LOW_SUN = Look(
    ground=(0.66, 0.58, 0.48),
    sky=(0.62, 0.50, 0.42),
    sun=(0.8, 0.3, -0.42),
    sunlight=(0.88, 0.62, 0.38),
    shade=(0.32, 0.30, 0.36),
    shadows=8192,
)
# The torso is lifted until its front feet leave the ground, and let go.
_LIFT = (
    (0.0, -0.16, 0.16, False),
    (0.3, 0.0, -0.04, True),
    (0.4, 0.0, -0.04, True),
    (0.9, 0.02, -0.17, True),
    (1.1, 0.02, -0.17, False),
    (1.75, 0.14, -0.08, False),
)
CUTS: Mapping[str, View | Hand] = {
    "stairs": View(
        "bastion",
        "stairs",
        start=100,
        azimuth=-68.0,
        elevation=8.0,
        distance=4.4,
        aim=-0.1,
        drives=False,
        settings={"difficulty": 1.0},
        seconds=1.75,
        fade=0,
        look=_LOW_SUN,
        shows_markers=False,
    ),
    "eight legs": View(
        generator.generate(legs=8, links=3),
        azimuth=-48.0,
        elevation=11.0,
        distance=4.6,
        aim=-0.35,
        drives=False,
        seconds=1.5,
        fade=0,
        look=_DAY,
    ),
    "kick": View(
        "queen",
        "shoved",
        seed=6,
        start=56,
        command=(1.0, 0.0, 0.0),
        elevation=11.0,
        distance=5.0,
        aim=-0.3,
        drives=False,
        seconds=2.0,
        fade=0,
        look=_DAY,
    ),
    "hand": Hand("queen", before=1.5, path=_LIFT, seconds=1.75),
}


def pictures_of(cut: View | Hand, size: tuple[int, int]) -> Iterator[np.ndarray]:
    """Yield the pictures (height, width, 3) of a cut."""
    if isinstance(cut, Hand):
        return hand.pictures_of(cut, size)
    return stage.pictures_of(cut, size, is_film=True)
