"""The controller on a board: firmware, emulated cores, footprint, processor in the loop."""
