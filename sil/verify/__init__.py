"""Evidence about the C of one set of settings: proof, rules, run-time checks, coverage, faults."""
