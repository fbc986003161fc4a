"""Processor in the loop: the controller on a board behind a serial port flies the simulated drone."""
