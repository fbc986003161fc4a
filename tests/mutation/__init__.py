"""The mutation tester of the C: small faults, and what notices them."""
