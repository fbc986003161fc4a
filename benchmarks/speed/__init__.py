"""Processor time of flights and of commands that fly."""
