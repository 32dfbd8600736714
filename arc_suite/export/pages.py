"""Pages that play walks: one HTML file each, with nothing to fetch, for any browser.

The bodies are drawn from their parts by three.js, which `make web` bundles with the viewer.
"""

import base64
import html
import itertools
import json
import string
import zlib
from collections.abc import Mapping
from importlib import resources
from typing import Any

import numpy as np

from arc_suite.envs.scene import prepared
from arc_suite.export.parts import parts as described
from arc_suite.models.outline import outline
from arc_suite.style.colours import TERM_COLOURS
from arc_suite.style.tracks import Track

_DIGITS = 6  # behind the point: micrometres, microradians
_TERRAIN = 0.25  # of the standing height, between points of uneven ground
_MARGIN = 5.0  # standing heights of ground about the way


def viewer() -> str:
    """Return the script of the viewer, three.js included.

    Raises:
        ValueError: it has not been built; one line.
    """
    script = resources.files("arc_suite.export").joinpath("web", "viewer.js")
    if not script.is_file():
        raise ValueError("no viewer for pages in this clone: `make web` builds it, which needs Node")
    return script.read_text(encoding="utf-8")


def page(tracks: Mapping[str, Track]) -> str:
    """Return a page that plays tracks side by side, by their labels.

    Raises:
        ValueError: the viewer has not been built; one line.
    """
    walks = json.dumps([_walk(label, track) for label, track in tracks.items()], separators=(",", ":"), allow_nan=False)
    data = base64.b64encode(zlib.compress(walks.encode(), 9)).decode()
    frame = string.Template(resources.files("arc_suite.export").joinpath("page.html").read_text(encoding="utf-8"))
    return frame.substitute(title=html.escape(", ".join(tracks)), data=data, viewer=viewer())


def _walk(label: str, track: Track) -> dict[str, Any]:
    """What the viewer takes of a track, in MuJoCo's axes."""
    parts, materials = described(track.body)
    height = track.body.torso.standing_height
    stance = track.parameters is not None
    arena = prepared(track.body, track.task, _settings(track))[0].scene.arena
    return {
        "label": label,
        "height": height,
        "reach": float(abs(outline(track.body)).max()),
        "step": track.time_step,
        "parts": [_plain(part._asdict() | {"shapes": [shape._asdict() for shape in part.shapes]}) for part in parts],
        "materials": {name: _plain(material._asdict()) for name, material in materials.items()},
        "terrain": None if arena.is_level else _terrain(arena, track.positions, height),
        "positions": _plain(track.positions),
        "quaternions": _plain(track.quaternions),
        "joints": _plain(track.joint_angles),
        "legs": list(track.legs),
        "stance": track.stance.astype(int).tolist() if stance else None,
        "schedule": track.schedule.astype(int).tolist() if stance else None,
        "terms": {name: _plain(track.weights[name] * values) for name, values in track.terms.items()},
        "colours": _colours(track.terms),
        "totals": _plain(track.rewards.cumsum()),
    }


def _settings(track: Track) -> dict[str, Any]:
    """The settings of the track's task that make its arena; not those of its runs."""
    return {name: value for name, value in track.task_kwargs.items() if name not in ("random", "on_divergence")}


def _colours(terms) -> dict[str, str]:
    """Colours of terms by name, those of the pictures where these have one."""
    free = itertools.cycle(
        [colour for name, colour in TERM_COLOURS.items() if name not in terms] or TERM_COLOURS.values()
    )
    return {name: TERM_COLOURS.get(name) or next(free) for name in terms}


def _terrain(arena, positions: np.ndarray, height: float) -> dict[str, Any]:
    """Heights of the ground about a way, (rows, columns), at even distances from the lowest x and y."""
    low, high = (extreme(axis=0)[:2] for extreme in (positions.min, positions.max))
    low, high, cell = low - _MARGIN * height, high + _MARGIN * height, _TERRAIN * height
    x, y = (np.arange(start, end + cell, cell) for start, end in zip(low, high, strict=True))
    return {"low": _plain(low), "cell": cell, "heights": _plain(arena.height(*np.meshgrid(x, y)))}


def _plain(value):
    """The value as JSON has it, with numbers rounded."""
    if isinstance(value, dict):
        return {name: _plain(item) for name, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, np.ndarray):
        return value.astype(float).round(_DIGITS).tolist()
    return value
