"""Learning: learners, studies and the benchmark, tuning, transfer between bodies; nothing of the core imports it."""
