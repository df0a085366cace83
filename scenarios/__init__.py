"""Floor 1: what stands on the table and what must become of it."""
