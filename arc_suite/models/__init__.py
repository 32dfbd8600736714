"""From a spec to MJCF: builder, standing pose, sizing, visuals."""

from arc_suite.models.assembly import assemble, parsed, text
from arc_suite.models.mjcf_text import written

__all__ = ["assemble", "parsed", "text", "written"]
