"""Disturbances and faults that befall a run: classes of them, when they come, what they do."""
