"""The JSON next to a sheet of sprites, as Aseprite exports it: Phaser, PixiJS, Unity and Godot read it."""

from collections.abc import Mapping, Sequence
from typing import Any

from arc_suite.animation.clips.clips import Clip
from arc_suite.animation.clips.filming import Sheet, count_frames


def describe_sheet(
    image_name: str, clips: Sequence[Clip], sheet: Sheet, left_out: Mapping[str, str] | None = None
) -> dict[str, Any]:
    """Return the frames of a sheet in reading order, and the tag of each row.

    The name of a frame is its number. `anchor` is the point of a frame that belongs on the ground below the torso, as
    shares of the frame from its upper left corner; `ground_line` is its height in pixels from the top. Rows are called
    after the clip and their heading, degrees to the left of its first row.

    Args:
        image_name: name of the picture's file.
        clips: clips that the sheet shows.
        sheet: the sheet.
        left_out: reasons why clips cannot be made, by name.
    """
    height, width, channels = sheet.picture.shape
    size = sheet.cell_size
    rows = height // size
    directions = rows // len(clips)
    frames: list[dict[str, Any]] = []
    tags = []
    for row in range(rows):
        clip_number, direction = divmod(row, directions)
        clip = clips[clip_number]
        first = len(frames)
        for column in range(count_frames(clip)):
            frames.append(_describe_frame(first + column, row, column, clip, sheet))
        tags.append(_describe_row(clip, 360.0 * direction / directions, first, len(frames) - 1))
    return {
        "frames": frames,
        "meta": {
            "app": "https://pypi.org/project/arc-suite/",
            "image": image_name,
            "format": "RGBA8888" if channels == 4 else "RGB888",
            "size": {"w": width, "h": height},
            "scale": "1",
            "frameTags": tags,
            "cell": {"w": size, "h": size},
            "columns": width // size,
            "rows": rows,
            "ground_line": round(sheet.ground_line, 2),
            "pixels_per_meter": round(sheet.pixels_per_meter, 4),
            "left_out": dict(left_out or {}),
        },
    }


def _describe_frame(number: int, row: int, column: int, clip: Clip, sheet: Sheet) -> dict[str, Any]:
    """Return a frame; its duration in whole ms keeps the sum of durations in time with the clip."""
    size = sheet.cell_size
    start = round(1000.0 * clip.motion.time_step * column)  # ms
    end = round(1000.0 * clip.motion.time_step * (column + 1))
    return {
        "filename": str(number),
        "frame": {"x": size * column, "y": size * row, "w": size, "h": size},
        "rotated": False,
        "trimmed": False,
        "spriteSourceSize": {"x": 0, "y": 0, "w": size, "h": size},
        "sourceSize": {"w": size, "h": size},
        "duration": end - start,
        "anchor": {"x": 0.5, "y": round(sheet.ground_line / size, 6)},
    }


def _describe_row(clip: Clip, heading: float, first: int, last: int) -> dict[str, Any]:
    """Return the tag of a row, which plays once if the clip does not loop.

    Args:
        clip: clip of the row.
        heading: degrees.
        first: number of its first frame.
        last: number of its last frame.
    """
    tag = {
        "name": f"{clip.name}_{heading:g}",
        "from": first,
        "to": last,
        "direction": "forward",
        "fps": round(1.0 / clip.motion.time_step, 6),
    }
    return tag if clip.loops else tag | {"repeat": "1"}
