"""Tests of sil/playground."""
