"""Floor 2: the world: robot model, observed scene, the Plant seam and PyBullet behind it."""
