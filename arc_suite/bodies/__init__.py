"""Environments of different bodies as one Gymnasium vector environment."""

from arc_suite.bodies.environments import BodiesEnv

__all__ = ["BodiesEnv"]
