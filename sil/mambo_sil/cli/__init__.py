"""The commands of `mambo-nmpc`: one file a command, their shared options, and progress."""
