"""The functional mock-up unit of a controller: a target of `generate --for`."""
