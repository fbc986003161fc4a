"""Tuning: search for settings with small tracking error and small command variation, on random flights."""
