"""Creatures found by search: bodies from genes, goals, trials by demonstrators, and an archive of the best."""
