"""Tests of the wing `pil` of `sil`, and of the firmware it talks to."""
