"""Floor 4: the primitives, one per file, and the catalogue `domain.pddl` beside them."""
