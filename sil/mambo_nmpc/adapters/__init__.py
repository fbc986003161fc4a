"""Adapters: the generated C in the simulators of others, each with a page in docs/how-to.

Each imports its simulator when it is used, and says which command installs one that is missing.
"""
