"""What a run leaves behind, and what is told of it."""
