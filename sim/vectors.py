"""Vectors in the world: its axes, and what of a vector lies along the floor."""

import numpy as np

LEFT, UP, FORWARD = np.eye(3)  # the character's, at yaw 0
FLOOR = LEFT + FORWARD  # a vector times this has lost its height
