"""Python's collector of cyclic garbage, told to look rarely: a run makes many objects and hardly a cycle."""

import gc

YOUNG, MIDDLE, OLD = 20_000, 20, 100
"""New objects before the youngest are looked through, and how many such looks before the older ones are."""


def collect_rarely() -> None:
    """From now on. Nothing is frozen: bindings whose objects live on at the end complain."""
    gc.set_threshold(YOUNG, MIDDLE, OLD)
