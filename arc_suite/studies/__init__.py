"""Studies: tables of runs, from which curves and comparisons are made."""
