"""Environments of different bodies as one Gymnasium vector environment."""

from arc_suite.envs.bodies.environments import BodiesEnv

__all__ = ["BodiesEnv"]
