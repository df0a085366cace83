"""Geometry of motion: collision, inverse kinematics, OMPL, timing."""
