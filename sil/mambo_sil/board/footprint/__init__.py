"""Flash, RAM, stack and instructions of a controller on a board."""
