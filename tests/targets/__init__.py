"""Tests of targets: folders that build as they are, and fly."""
