"""Floor 3: task planning, motion planning, and the search-then-sample loop between them."""
