"""Palettes: colors of the five materials of any body, by name or by seed."""

import colorsys
import random

from arc_suite import checks
from arc_suite.robots.spec import PALETTES

Color = tuple[float, float, float]  # sRGB, 0 to 1

_MATERIALS = ("shell", "trim", "frame", "limb", "glow")
# In the order of `PALETTES`; in each the colors in the order of `_MATERIALS`.
_COLORS_OF_PALETTES = (
    ((0.42, 0.52, 0.28), (0.24, 0.30, 0.16), (0.12, 0.13, 0.10), (0.30, 0.29, 0.22), (0.85, 0.90, 0.15)),
    ((0.62, 0.32, 0.18), (0.36, 0.20, 0.14), (0.14, 0.12, 0.11), (0.34, 0.28, 0.25), (0.10, 0.80, 0.85)),
    ((0.86, 0.82, 0.72), (0.55, 0.48, 0.38), (0.20, 0.18, 0.16), (0.46, 0.42, 0.36), (0.90, 0.25, 0.10)),
    ((0.90, 0.45, 0.40), (0.55, 0.22, 0.28), (0.16, 0.12, 0.15), (0.50, 0.34, 0.36), (0.20, 0.95, 0.75)),
    ((0.16, 0.20, 0.34), (0.10, 0.11, 0.20), (0.06, 0.06, 0.09), (0.18, 0.20, 0.28), (0.25, 0.60, 1.00)),
)


def colors(palette: str | int) -> dict[str, Color]:
    """Return the colors of the materials by name.

    Args:
        palette: one of `spec.PALETTES`, or a seed: the shell gets a random hue, the glow a nearly opposite one.
    """
    if isinstance(palette, str):
        colors_of_materials = _COLORS_OF_PALETTES[PALETTES.index(palette)]
    else:
        colors_of_materials = _draw_colors(palette)
    return dict(zip(_MATERIALS, colors_of_materials, strict=True))


def parse(text: str) -> str | int:
    """Return the palette that a text names: digits are a seed.

    Raises:
        ValueError: neither a name nor digits.
    """
    seed = checks.digits(text)
    return checks.name(text, PALETTES, "palette", suggestions=["a seed, such as 7"]) if seed is None else seed


def _draw_colors(seed: int) -> tuple[Color, ...]:
    """Return the colors of a seed in the order of `_MATERIALS`."""
    generator = random.Random(seed)
    hue = generator.random()
    saturation = generator.uniform(0.15, 0.65)
    brightness = generator.uniform(0.4, 0.9)
    glow_hue = hue + 0.5 + generator.uniform(-0.15, 0.15)
    glow_saturation = generator.uniform(0.7, 0.95)
    return (
        colorsys.hsv_to_rgb(hue, saturation, brightness),
        colorsys.hsv_to_rgb(hue, saturation, 0.55 * brightness),
        colorsys.hsv_to_rgb(hue, 0.3 * saturation, 0.15),
        colorsys.hsv_to_rgb(hue, 0.4 * saturation, 0.45 * brightness),
        colorsys.hsv_to_rgb(glow_hue % 1.0, glow_saturation, 0.95),
    )
