"""Identification: a model of the drone from flight logs."""
