"""Layouts of the blocks scan, ranges and goal, in which a body senses ground, pillars and goals."""

import math

import numpy as np

# The block `scan`: points forward and left of the torso, in R, the mean distance of the feet from their center.
# They are denser forward than to the side, as trenches lie across the way.
FORWARD = np.linspace(-1.5, 2.1, 25)
LEFT = np.linspace(-1.2, 1.2, 7)
SCAN = np.stack(np.meshgrid(FORWARD, LEFT, indexing="ij")).reshape(2, -1)

# The block `ranges`: directions (2, 24) of rays, forward and left, all around, forward first, then to the left.
RAYS = np.stack([function(math.radians(15.0) * np.arange(24)) for function in (np.cos, np.sin)])
SIGHT = 6.0  # range of the range sensor, R

FAR = 7.0  # largest distance that the block `goal` shows, R
