"""Families of bodies: a body for every seed. `registry.FAMILIES` names them."""

from collections.abc import Callable

import numpy as np

from arc_suite import checks
from arc_suite.bodies import generator, varied
from arc_suite.models.overlap import overlaps
from arc_suite.models.soundness import has_flaws
from arc_suite.robots.spec import Body, SpecError

MAX_DRAWS = 100  # for one seed


def sound_body(seed: int, legs: int | None = None, links: int | None = None, layout: str | None = None) -> Body:
    """Return a random body without overlaps, the same for the same arguments; see `generator.draw_body`.

    The first draw is `generator.random_body`. Later ones, as of `varied_body`, keep its numbers of legs and links.

    Args:
        seed: 0 or more.
        legs: 4 to 12.
        links: 1 to 4; legs of one link keep the flaw that they do not lift their feet.
        layout: pairs or radial.

    Returns:
        The body, `random_<seed>`.

    Raises:
        ValueError: a value out of range.
    """
    first_body = generator.random_body(seed, legs, links, layout)
    leg_count = len(first_body.legs)
    link_count = len(first_body.legs[0].links)

    def draw(random: np.random.Generator) -> Body:
        return generator.draw_body(random, leg_count, link_count, layout)

    # The first draw is `first_body` again: NumPy's generator of (seed, 0) is that of the seed.
    return sound(draw, "random", seed, lambda body: any(overlaps(body)))


def varied_body(seed: int) -> Body:
    """Return a random body of a wide family, the same for the same seed; see `varied.draw_varied_body`.

    Every body passes `soundness.flaws`. Draw k of seed s comes from `numpy.random.default_rng((s, k))`, and the
    first sound one is the body.

    Args:
        seed: 0 or more.

    Returns:
        The body, `varied_<seed>`.

    Raises:
        ValueError: not a seed.
    """
    return sound(varied.draw_varied_body, "varied", seed)


def sound(
    draw: Callable[[np.random.Generator], Body],
    family: str,
    seed: int,
    is_unsound: Callable[[Body], bool] = has_flaws,
) -> Body:
    """Return the first sound body that is drawn for a seed, `<family>_<seed>`; see `varied_body`.

    Args:
        draw: returns a body, or raises a SpecError.
        family: its name.
        seed: 0 or more.
        is_unsound: returns whether a body must be drawn again.

    Raises:
        ValueError: not a seed, or a family without sound bodies.
    """
    checks.seed(seed)
    for attempt in range(MAX_DRAWS):
        random = np.random.default_rng((seed, attempt))
        try:
            body = draw(random).replace(name=f"{family}_{seed}")
        except SpecError:  # a length is out of range
            continue
        if not is_unsound(body):
            return body
    raise ValueError(f"{family}:{seed}: none of {MAX_DRAWS} draws stands and can take steps; see arc-suite check")


def few_legs(seed: int) -> Body:
    """Return a random body of 4 to 8 legs, for policies that are tested with more; see `sound_body`."""
    legs = 4 + checks.seed(seed) % 5
    return sound_body(seed, legs=legs).replace(name=f"few_legs_{seed}")


def few_links(seed: int) -> Body:
    """Return a random body of 2 or 3 links a leg, for policies that are tested with 4; see `sound_body`."""
    links = 2 + checks.seed(seed) % 2
    return sound_body(seed, links=links).replace(name=f"few_links_{seed}")
