"""Pages that play walks: one HTML file each, with nothing to fetch, for any browser.

The bodies are drawn from their parts by three.js, which `make web` bundles with the viewer.
"""

import base64
import html
import itertools
import json
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

_PAGE = """\
<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<link rel="icon" href="data:,">
<title>{title}</title>
<style>
* {{ box-sizing: border-box; }}
html, body {{ margin: 0; height: 100%; background: #1d232b; color: #d7dde5; font: 14px system-ui, sans-serif; }}
body {{ display: flex; flex-direction: column; }}
#walks {{ flex: 1; min-height: 0; display: grid; grid-auto-flow: column; grid-auto-columns: 1fr; gap: 2px; }}
section {{ display: flex; flex-direction: column; min-width: 0; min-height: 0; }}
h2 {{ margin: 0; padding: 6px 10px; font-size: 13px; font-weight: 600; }}
canvas {{ display: block; width: 100%; }}
.view {{ flex: 1; min-height: 0; touch-action: none; }}
.gait {{ margin-top: 4px; }}
.reward {{ height: 130px; margin-top: 4px; }}
footer {{ display: flex; align-items: center; gap: 10px; padding: 8px 10px; }}
footer input {{ flex: 1; }}
button {{ width: 5em; }}
#clock {{ font-variant-numeric: tabular-nums; }}
small {{ color: #8791a0; }}
</style>
</head>
<body>
<div id="walks"></div>
<footer>
<button id="play">pause</button>
<input id="time" type="range" min="0" value="0">
<span id="clock"></span>
<select id="speed"></select>
<small>space, arrows, home, end; drag turns the view, the wheel zooms</small>
</footer>
<script id="data" type="text/plain">{data}</script>
<script>
{viewer}
</script>
</body>
</html>
"""


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
    return _PAGE.format(title=html.escape(", ".join(tracks)), data=data, viewer=viewer())


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
