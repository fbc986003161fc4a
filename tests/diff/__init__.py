"""Tests of sil/diff."""
