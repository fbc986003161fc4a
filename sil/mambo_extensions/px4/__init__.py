"""The module of PX4 that flies a controller: a target of `generate --for`."""
