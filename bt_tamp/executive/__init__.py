"""The behaviour tree that plans, acts, watches and plans again."""
