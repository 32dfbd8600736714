"""Where a body senses ground, pillars and goals: the layouts of the blocks scan, ranges and goal."""

import math

import numpy as np

# The block `scan`: places forward and left of the torso, in R, the mean distance of the feet from their center.
# They are denser along the lane, where trenches lie across.
FORWARD, LEFT = np.linspace(-1.5, 2.1, 25), np.linspace(-1.2, 1.2, 7)
SCAN = np.stack(np.meshgrid(FORWARD, LEFT, indexing="ij")).reshape(2, -1)

# The block `ranges`: directions (2, 24) of rays, forward and left, all around, forward first, then to the left.
RAYS = np.stack([function(math.radians(15.0) * np.arange(24)) for function in (np.cos, np.sin)])
SIGHT = 6.0  # range of the range sensor, R

FAR = 7.0  # distance from which on the block `goal` says far, R
