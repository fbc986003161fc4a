"""Tests of sil.show."""
