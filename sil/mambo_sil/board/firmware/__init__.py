"""Build firmware for a board; measure flash, static RAM and worst-case stack of the linked program."""
