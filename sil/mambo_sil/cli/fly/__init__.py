"""The command `fly` and the commands that fly many times."""
