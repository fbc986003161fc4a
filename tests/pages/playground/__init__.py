"""Tests of sil/mambo_sil/pages/playground."""
