"""Margins of drawn drones and of settings, beside what they fly."""
