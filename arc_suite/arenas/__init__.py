"""Where creatures walk: the geometry of the ground and its height."""
