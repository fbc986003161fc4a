"""Table II of the paper, flown again."""
