"""The JSON next to a sheet of sprites, as Aseprite exports it: Phaser, PixiJS, Unity and Godot read it."""

from typing import Any

from arc_suite.animation.clips.clips import Clip
from arc_suite.animation.clips.filming import Sheet


def describe_sheet(image_name: str, clip: Clip, sheet: Sheet) -> dict[str, Any]:
    """Return the frames of a sheet in reading order, and the tag of each row.

    The name of a frame is its number. `anchor` is the point of a frame that belongs on the ground below the torso, as
    shares of the frame from its upper left corner; `ground_line` is its height in pixels from the top. Rows are called
    after the clip and their heading, degrees to the left of the first row.

    Args:
        image_name: name of the picture's file.
        clip: clip that the sheet shows.
        sheet: the sheet.
    """
    height, width, channels = sheet.picture.shape
    size = sheet.cell_size
    rows = height // size
    columns = width // size
    frames = []
    for row in range(rows):
        for column in range(columns):
            frames.append(_describe_frame(len(frames), row, column, clip, sheet))
    return {
        "frames": frames,
        "meta": {
            "app": "https://pypi.org/project/arc-suite/",
            "image": image_name,
            "format": "RGBA8888" if channels == 4 else "RGB888",
            "size": {"w": width, "h": height},
            "scale": "1",
            "frameTags": [_describe_row(row, rows, columns, clip) for row in range(rows)],
            "cell": {"w": size, "h": size},
            "columns": columns,
            "rows": rows,
            "fps": round(1.0 / clip.motion.time_step, 6),
            "ground_line": round(sheet.ground_line, 2),
            "pixels_per_meter": round(sheet.pixels_per_meter, 4),
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


def _describe_row(row: int, rows: int, columns: int, clip: Clip) -> dict[str, Any]:
    """Return the tag of a row, which plays once if the clip does not loop."""
    tag = {
        "name": f"{clip.name}_{360.0 * row / rows:g}",
        "from": columns * row,
        "to": columns * (row + 1) - 1,
        "direction": "forward",
    }
    return tag if clip.loops else tag | {"repeat": "1"}
