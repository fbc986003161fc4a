"""Searches for the gains of laws without a model, on drawn flights."""
