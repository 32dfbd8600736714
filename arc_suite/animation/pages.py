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
from arc_suite.animation.parts import describe_body
from arc_suite.animation.scenery import describe_scenery
from arc_suite.models.outline import outline
from arc_suite.robots.spec import Body
from arc_suite.style.tracks import Track

_DECIMALS = 6  # of numbers in a page: micrometers, microradians


def read_built_file(name: str) -> bytes:
    """Return a file that `make web` builds.

    Raises:
        ValueError: it has not been built.
    """
    file = resources.files("arc_suite.animation").joinpath("web", name)
    if not file.is_file():
        if versions.clone_folder():
            remedy = "`make web` builds it"
        else:
            remedy = "install a wheel that `make dist` has built in a clone"
        raise ValueError(f"no viewer for pages: {remedy}, which needs Node, https://nodejs.org")
    return file.read_bytes()


def viewer_script() -> str:
    """Return the script of the viewer, three.js included; errors as `read_built_file`."""
    return read_built_file("viewer.js").decode()


def template(name: str) -> string.Template:
    """Return the HTML of a page, in which data and scripts are missing."""
    file = resources.files("arc_suite.animation").joinpath(name)
    return string.Template(file.read_text(encoding="utf-8"))


def pack(value) -> str:
    """Return JSON of a value, deflated, in base64."""
    text = json.dumps(value, separators=(",", ":"), allow_nan=False)
    return base64.b64encode(zlib.compress(text.encode(), 9)).decode()


def page(tracks: Mapping[str, Track]) -> str:
    """Return a page that plays tracks side by side, by their labels.

    Raises:
        ValueError: the viewer has not been built.
    """
    walks = [_walk(label, track) for label, track in tracks.items()]
    return template("page.html").substitute(
        title=html.escape(", ".join(tracks)), data=pack(walks), viewer=viewer_script()
    )


def _walk(label: str, track: Track) -> dict[str, Any]:
    """Return what the viewer takes of a track, in MuJoCo's axes."""
    stance = None
    schedule = None
    has_gait = track.parameters is not None
    if has_gait:
        stance = track.stance.astype(int).tolist()  # (steps, legs) 1 or 0
        schedule = track.schedule.astype(int).tolist()
    weighted_terms = {name: track.weights[name] * values for name, values in track.terms.items()}
    return body_drawing(track.body) | {
        "label": label,
        "step": track.time_step,
        "scenery": to_json_values(describe_scenery(track)),
        "positions": to_json_values(track.positions),
        "quaternions": to_json_values(track.quaternions),
        "joints": to_json_values(track.joint_angles),
        "legs": list(track.legs),
        "stance": stance,
        "schedule": schedule,
        "terms": to_json_values(weighted_terms),
        "colors": term_colors(track.terms),
        "totals": to_json_values(track.rewards.cumsum()),
    }


def body_drawing(body: Body) -> dict[str, Any]:
    """Return what a page draws of a body: its parts and their materials, with its height and reach, m."""
    parts, materials = describe_body(body)
    return {
        "height": body.torso.standing_height,
        "reach": float(abs(outline(body)).max()),
        "parts": to_json_values(parts),
        "materials": to_json_values(materials),
    }


def to_json_values(value, decimals: int | None = _DECIMALS):
    """Return a value of arrays, tuples and dictionaries as one of lists and dictionaries, as JSON has it.

    Args:
        value: finite numbers, text, None and truth values.
        decimals: decimals to which floating-point numbers are rounded; None for all.
    """
    if hasattr(value, "_asdict"):
        value = value._asdict()
    if isinstance(value, dict):
        return {name: to_json_values(item, decimals) for name, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [to_json_values(item, decimals) for item in value]
    if isinstance(value, np.ndarray):
        if value.dtype.kind == "i":
            return value.tolist()
        numbers = value.astype(float)
        if decimals is not None:
            numbers = numbers.round(decimals)
        return numbers.tolist()
    if isinstance(value, float) and decimals is not None:
        return round(value, decimals)
    return value
