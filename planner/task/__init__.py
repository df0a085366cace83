"""PDDL: symbols, facts of a scene, Pyperplan, and what failures teach."""
