"""Floor 5: the executive and everything a person touches."""

__version__ = "0.1.0"
