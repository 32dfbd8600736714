"""Creatures found by search: bodies from genes, goals by which demonstrators judge them, and an archive of the best."""
