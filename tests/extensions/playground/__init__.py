"""Tests of sil/mambo_extensions/playground."""
