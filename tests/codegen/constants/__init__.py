"""Derived constants against their definitions, by other routes."""
