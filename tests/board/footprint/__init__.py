"""Tests of footprint."""
