"""The port: one table of what a controller takes, gives and keeps; all that lists these numbers reads it."""
