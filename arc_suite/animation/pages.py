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
from arc_suite.animation.colors import term_colors
from arc_suite.animation.parts import describe_body as described
from arc_suite.animation.scenery import describe_scenery
from arc_suite.models.outline import outline
from arc_suite.robots.spec import Body
from arc_suite.style.tracks import Track

_DIGITS = 6  # behind the point: micrometers, microradians


def read_built_file(name: str) -> bytes:
    """Return a file that `make web` builds.

    Raises:
        ValueError: it has not been built.
    """
    file = resources.files("arc_suite.animation").joinpath("web", name)
    if not file.is_file():
        cure = (
            "`make web` builds it"
            if versions.clone_folder()
            else "install a wheel that `make dist` has built in a clone"
        )
        raise ValueError(f"no viewer for pages: {cure}, which needs Node")
    return file.read_bytes()


def viewer_script() -> str:
    """Return the script of the viewer, three.js included; errors as `built`."""
    return read_built_file("viewer.js").decode()


def template(name: str) -> string.Template:
    """Return the frame of a page."""
    return string.Template(resources.files("arc_suite.animation").joinpath(name).read_text(encoding="utf-8"))


def pack(value) -> str:
    """Return JSON of a value, deflated, in base64."""
    text = json.dumps(value, separators=(",", ":"), allow_nan=False)
    return base64.b64encode(zlib.compress(text.encode(), 9)).decode()


def page(tracks: Mapping[str, Track]) -> str:
    """Return a page that plays tracks side by side, by their labels.

    Raises:
        ValueError: the viewer has not been built.
    """
    return template("page.html").substitute(
        title=html.escape(", ".join(tracks)),
        data=pack([_walk(label, track) for label, track in tracks.items()]),
        viewer=viewer_script(),
    )


def body_drawing(body: Body) -> dict[str, Any]:
    """Return what a page draws of a body, its parts and their materials, with its height and reach, m."""
    parts, materials = described(body)
    sizes = {"height": body.torso.standing_height, "reach": float(abs(outline(body)).max())}
    return sizes | {"parts": to_json_values(parts), "materials": to_json_values(materials)}


def _walk(label: str, track: Track) -> dict[str, Any]:
    """What the viewer takes of a track, in MuJoCo's axes."""
    stance = track.parameters is not None
    return body_drawing(track.body) | {
        "label": label,
        "step": track.time_step,
        "scenery": to_json_values(describe_scenery(track)),
        "positions": to_json_values(track.positions),
        "quaternions": to_json_values(track.quaternions),
        "joints": to_json_values(track.joint_angles),
        "legs": list(track.legs),
        "stance": track.stance.astype(int).tolist() if stance else None,
        "schedule": track.schedule.astype(int).tolist() if stance else None,
        "terms": {name: to_json_values(track.weights[name] * values) for name, values in track.terms.items()},
        "colors": term_colors(track.terms),
        "totals": to_json_values(track.rewards.cumsum()),
    }


def to_json_values(value, digits: int | None = _DIGITS):
    """Return a value of arrays, tuples and dictionaries as JSON has it.

    Args:
        value: of finite numbers, text, None and truth values.
        digits: behind the point, to which numbers are rounded; None for all.
    """
    if hasattr(value, "_asdict"):
        value = value._asdict()
    if isinstance(value, dict):
        return {name: to_json_values(item, digits) for name, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [to_json_values(item, digits) for item in value]
    if isinstance(value, np.ndarray) and value.dtype.kind == "i":
        return value.tolist()
    if isinstance(value, np.ndarray):
        return (value.astype(float) if digits is None else value.astype(float).round(digits)).tolist()
    if isinstance(value, float) and digits is not None:
        return round(value, digits)
    return value
