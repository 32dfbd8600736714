"""Palettes: colors of the five materials of any body, by name, by seed, or as the colors themselves."""

import colorsys
import random

from arc_suite import checks
from arc_suite.robots.spec import COLORS_EXAMPLE, MATERIALS, PALETTES, nearest_colors

Color = tuple[float, float, float]  # sRGB, 0 to 1

_COUNTED_COLORS = f"1 to {len(MATERIALS)} colors, of {', '.join(MATERIALS)}, such as '{COLORS_EXAMPLE}'"
HELP = f"{', '.join(PALETTES)}; a seed; or {_COUNTED_COLORS}"
_GLOW_SATURATION = 0.8  # of a glow that suits a shell

# In the order of `PALETTES`; in each the colors in the order of `MATERIALS`.
_COLORS_OF_PALETTES = (
    ((0.42, 0.52, 0.28), (0.30, 0.29, 0.22), (0.85, 0.90, 0.15), (0.12, 0.13, 0.10), (0.24, 0.30, 0.16)),
    ((0.62, 0.32, 0.18), (0.34, 0.28, 0.25), (0.10, 0.80, 0.85), (0.14, 0.12, 0.11), (0.36, 0.20, 0.14)),
    ((0.86, 0.82, 0.72), (0.46, 0.42, 0.36), (0.90, 0.25, 0.10), (0.20, 0.18, 0.16), (0.55, 0.48, 0.38)),
    ((0.90, 0.45, 0.40), (0.50, 0.34, 0.36), (0.20, 0.95, 0.75), (0.16, 0.12, 0.15), (0.55, 0.22, 0.28)),
    ((0.16, 0.20, 0.34), (0.18, 0.20, 0.28), (0.25, 0.60, 1.00), (0.06, 0.06, 0.09), (0.10, 0.11, 0.20)),
)


def colors(palette: str | int) -> dict[str, Color]:
    """Return the colors of the materials by name.

    Args:
        palette: as `Body.palette`, without None. With a seed the shell gets a random hue, the glow a nearly opposite
            one. Colors are those of the first of `spec.MATERIALS`; the others suit the color of the shell.
    """
    if not isinstance(palette, str):
        colors_of_materials = _draw_colors(palette)
    elif palette in PALETTES:
        colors_of_materials = _COLORS_OF_PALETTES[PALETTES.index(palette)]
    else:
        colors_of_materials = _complete_colors(palette)
    return dict(zip(MATERIALS, colors_of_materials, strict=True))


def parse(text: str) -> str | int:
    """Return the palette that a text names: digits are a seed.

    Raises:
        ValueError: neither a name, digits nor colors.
    """
    seed = checks.digits(text)
    if seed is not None:
        return seed
    colors = nearest_colors(text)
    if colors == text.lower():
        return colors
    words = text.split(",")
    wrong_words = [word for word in words if nearest_colors(word) is None]
    if wrong_words and len(words) > 1:
        wrong_word = checks.preview(wrong_words[0])
        raise ValueError(f"palette {checks.preview(text)}: {wrong_word} is no color; expected such as {COLORS_EXAMPLE}")
    suggestions = [colors] if colors else []
    descriptions = ["a seed, such as 7", f"colors, such as {COLORS_EXAMPLE}"]
    return checks.name(text, PALETTES, "palette", suggestions, descriptions)


def _complete_colors(text: str) -> tuple[Color, ...]:
    """Return the colors of a text in the order of `MATERIALS`, with colors that suit the first for those left out."""
    colors: list[Color] = []
    for color in text.split(","):
        red, green, blue = bytes.fromhex(color.removeprefix("#"))
        colors.append((red / 255.0, green / 255.0, blue / 255.0))
    hue, saturation, brightness = colorsys.rgb_to_hsv(*colors[0])
    suitable_colors = _suit_shell(hue, saturation, brightness, hue + 0.5, _GLOW_SATURATION)
    return (*colors, *suitable_colors[len(colors) :])


def _draw_colors(seed: int) -> tuple[Color, ...]:
    """Return the colors of a seed in the order of `MATERIALS`."""
    generator = random.Random(seed)
    hue = generator.random()
    saturation = generator.uniform(0.15, 0.65)
    brightness = generator.uniform(0.4, 0.9)
    glow_hue = hue + 0.5 + generator.uniform(-0.15, 0.15)
    glow_saturation = generator.uniform(0.7, 0.95)
    return _suit_shell(hue, saturation, brightness, glow_hue, glow_saturation)


def _suit_shell(
    hue: float, saturation: float, brightness: float, glow_hue: float, glow_saturation: float
) -> tuple[Color, ...]:
    """Return a shell's color and those that suit it, in the order of `MATERIALS`.

    Args:
        hue, saturation, brightness: of the shell, 0 to 1.
        glow_hue: of the glow; whole turns are left out.
        glow_saturation: of the glow, 0 to 1.
    """
    return (
        colorsys.hsv_to_rgb(hue, saturation, brightness),
        colorsys.hsv_to_rgb(hue, 0.4 * saturation, 0.45 * brightness),
        colorsys.hsv_to_rgb(glow_hue % 1.0, glow_saturation, 0.95),
        colorsys.hsv_to_rgb(hue, 0.3 * saturation, 0.15),
        colorsys.hsv_to_rgb(hue, saturation, 0.55 * brightness),
    )
