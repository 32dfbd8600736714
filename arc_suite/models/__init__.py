"""From a spec to MJCF: builder, standing pose, sizing, visuals."""

from arc_suite.models.assembly import assemble, parsed

__all__ = ["assemble", "parsed"]
