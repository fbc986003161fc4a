"""Evidence about the C of one controller: warnings, rules, proof, sanitizers, fuzzing, bits, faults."""
