"""From a spec to MJCF: builder, standing pose, sizing, looks."""

from arc_suite.models.assembly import assemble

__all__ = ["assemble"]
