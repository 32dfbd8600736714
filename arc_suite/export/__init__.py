"""Walks to take away: animation clips for game engines, and pages that play them."""

from arc_suite.export.catalogue import ALL, CLIPS, DEFAULT
from arc_suite.export.clips import FPS, Clip, clips
from arc_suite.export.creatures import RIGS, glb
from arc_suite.export.metadata import ROOT_MOTIONS, sidecar

__all__ = ["ALL", "CLIPS", "DEFAULT", "FPS", "Clip", "RIGS", "ROOT_MOTIONS", "clips", "glb", "sidecar"]
