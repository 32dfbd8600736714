"""The project's own studies: their tables of runs, the paper's claims, the leaderboard, tables of pages."""
