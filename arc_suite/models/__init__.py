"""From a spec to MJCF: builder, standing pose, sizing, visuals."""

from arc_suite.models.assembly import assemble, model_spec, text
from arc_suite.models.mjcf_text import to_mjcf

__all__ = ["assemble", "model_spec", "text", "to_mjcf"]
