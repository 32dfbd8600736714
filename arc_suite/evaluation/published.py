"""Returns that the paper publishes for the task walk, by robot. `studies/paper.csv` holds the same as a table."""

# Of the demonstrators, read off the expert lines of the figures.
DEMONSTRATORS = {"queen": 2048.0, "bastion": 2311.0, "tick": 1971.0, "leaper": 2630.0}

# After 1,000,000 steps, by algorithm: mean of five seeds, read off the curves, within about 30.
FINALS: dict[str, dict[str, float]] = {
    "leaper": {"sac": 2860, "speq": 3120, "sope_eo": 3310, "sacfd": 3520, "speq_o2o": 3550, "sope": 3760},
    "bastion": {"sac": 3080, "speq": 3350, "sope_eo": 3530, "sacfd": 3530, "speq_o2o": 3680, "sope": 3690},
    "queen": {"sac": 3520, "speq": 3330, "sope_eo": 3580, "sacfd": 3220, "speq_o2o": 3620, "sope": 3730},
    "tick": {"sac": 2590, "speq": 3590, "sope_eo": 3490, "sacfd": 3160, "speq_o2o": 3720, "sope": 3610},
}
