"""Tests of sil/derivation."""
