"""Pages that play walks: one HTML file each, with nothing to fetch, for any browser.

The bodies are drawn from their parts by three.js, which `make web` bundles with the viewer.
"""

import base64
import html
import json
import string
import zlib
from collections.abc import Mapping
from importlib import resources
from typing import Any

import numpy as np

from arc_suite import versions
from arc_suite.export.parts import parts as described
from arc_suite.export.scenery import scenery
from arc_suite.models.outline import outline
from arc_suite.style.colours import of_terms
from arc_suite.style.tracks import Track

_DIGITS = 6  # behind the point: micrometres, microradians


def viewer() -> str:
    """Return the script of the viewer, three.js included.

    Raises:
        ValueError: it has not been built.
    """
    script = resources.files("arc_suite.export").joinpath("web", "viewer.js")
    if not script.is_file():
        cure = "`make web` builds it" if versions.clone() else "install a wheel that `make dist` has built in a clone"
        raise ValueError(f"no viewer for pages: {cure}, which needs Node")
    return script.read_text(encoding="utf-8")


def page(tracks: Mapping[str, Track]) -> str:
    """Return a page that plays tracks side by side, by their labels.

    Raises:
        ValueError: the viewer has not been built.
    """
    walks = json.dumps([_walk(label, track) for label, track in tracks.items()], separators=(",", ":"), allow_nan=False)
    data = base64.b64encode(zlib.compress(walks.encode(), 9)).decode()
    frame = string.Template(resources.files("arc_suite.export").joinpath("page.html").read_text(encoding="utf-8"))
    return frame.substitute(title=html.escape(", ".join(tracks)), data=data, viewer=viewer())


def _walk(label: str, track: Track) -> dict[str, Any]:
    """What the viewer takes of a track, in MuJoCo's axes."""
    parts, materials = described(track.body)
    stance = track.parameters is not None
    return {
        "label": label,
        "height": track.body.torso.standing_height,
        "reach": float(abs(outline(track.body)).max()),
        "step": track.time_step,
        "parts": [_plain(part._asdict() | {"shapes": [shape._asdict() for shape in part.shapes]}) for part in parts],
        "materials": {name: _plain(material._asdict()) for name, material in materials.items()},
        "scenery": _plain(scenery(track)),
        "positions": _plain(track.positions),
        "quaternions": _plain(track.quaternions),
        "joints": _plain(track.joint_angles),
        "legs": list(track.legs),
        "stance": track.stance.astype(int).tolist() if stance else None,
        "schedule": track.schedule.astype(int).tolist() if stance else None,
        "terms": {name: _plain(track.weights[name] * values) for name, values in track.terms.items()},
        "colours": of_terms(track.terms),
        "totals": _plain(track.rewards.cumsum()),
    }


def _plain(value):
    """The value as JSON has it, with numbers rounded."""
    if isinstance(value, dict):
        return {name: _plain(item) for name, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, np.ndarray):
        return value.astype(float).round(_DIGITS).tolist()
    if isinstance(value, float):
        return round(value, _DIGITS)
    return value
