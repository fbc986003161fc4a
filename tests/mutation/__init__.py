"""The mutation testers of C and Python: small faults, and what notices them."""
