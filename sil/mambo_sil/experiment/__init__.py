"""Many flights: campaigns, suites, faults, Table II, two controllers compared."""
