"""Palettes: colors of the five materials of any body, by name or by seed."""

import colorsys
import random

from arc_suite.robots.spec import PALETTES

Color = tuple[float, float, float]

_MATERIALS = ("shell", "trim", "frame", "limb", "glow")
_NAMED = (  # in the order of `PALETTES`; sRGB, 0 to 1
    ((0.42, 0.52, 0.28), (0.24, 0.30, 0.16), (0.12, 0.13, 0.10), (0.30, 0.29, 0.22), (0.85, 0.90, 0.15)),
    ((0.62, 0.32, 0.18), (0.36, 0.20, 0.14), (0.14, 0.12, 0.11), (0.34, 0.28, 0.25), (0.10, 0.80, 0.85)),
    ((0.86, 0.82, 0.72), (0.55, 0.48, 0.38), (0.20, 0.18, 0.16), (0.46, 0.42, 0.36), (0.90, 0.25, 0.10)),
    ((0.90, 0.45, 0.40), (0.55, 0.22, 0.28), (0.16, 0.12, 0.15), (0.50, 0.34, 0.36), (0.20, 0.95, 0.75)),
    ((0.16, 0.20, 0.34), (0.10, 0.11, 0.20), (0.06, 0.06, 0.09), (0.18, 0.20, 0.28), (0.25, 0.60, 1.00)),
)


def colors(palette: str | int) -> dict[str, Color]:
    """Return the colors of the materials, sRGB from 0 to 1.

    Args:
        palette: of `spec.PALETTES`, or a seed: a hue of the shell, and an opposite one of what glows.
    """
    return dict(
        zip(_MATERIALS, _NAMED[PALETTES.index(palette)] if isinstance(palette, str) else _drawn(palette), strict=True)
    )


def parse(text: str) -> str | int:
    """Return the palette that a text names: digits are a seed."""
    return int(text) if text.isdecimal() else text


def _drawn(seed: int) -> tuple[Color, ...]:
    draw = random.Random(seed)
    hue, rich, bright = draw.random(), draw.uniform(0.15, 0.65), draw.uniform(0.4, 0.9)
    opposite = hue + 0.5 + draw.uniform(-0.15, 0.15)
    return (
        colorsys.hsv_to_rgb(hue, rich, bright),
        colorsys.hsv_to_rgb(hue, rich, 0.55 * bright),
        colorsys.hsv_to_rgb(hue, 0.3 * rich, 0.15),
        colorsys.hsv_to_rgb(hue, 0.4 * rich, 0.45 * bright),
        colorsys.hsv_to_rgb(opposite % 1.0, draw.uniform(0.7, 0.95), 0.95),
    )
