"""Tests of flights over MAVLink: the pilot, and an autopilot of our own behind a UDP socket."""
