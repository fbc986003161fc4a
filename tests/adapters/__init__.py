"""Tests of sil/mambo_nmpc/adapters."""
