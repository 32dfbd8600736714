"""Walks to take away: animation clips for game engines, and pages that play them."""

from arc_suite.animation.clips.catalog import ALL, CLIPS, DEFAULT
from arc_suite.animation.clips.clip_files import animate
from arc_suite.animation.clips.clips import FPS, Clip, clips
from arc_suite.animation.clips.creatures import RIGS, glb
from arc_suite.animation.clips.metadata import ROOT_MOTIONS, sidecar

__all__ = ["ALL", "CLIPS", "DEFAULT", "FPS", "Clip", "RIGS", "ROOT_MOTIONS", "animate", "clips", "glb", "sidecar"]
