"""The names on the page of the Python API: the docstrings of the public names of `mambo_nmpc`."""

from typing import Final

import mambo_nmpc

MEMBERS: Final = {"Vehicle": ["from_preset", "from_file"]}
"""What is public of a class that has more than a program should use."""

MODULES: Final = ("mambo_nmpc.curves",)
"""Modules with public names of their own."""


def python_part() -> str:
    """Return for mkdocstrings the place of each public name, in the folders of the repository."""
    homes = {name: getattr(mambo_nmpc, name).__module__ for name in mambo_nmpc.__all__}
    blocks = [
        f"::: {home.removeprefix('mambo_nmpc.')}.{name}\n"
        + (f"    options:\n      members: {MEMBERS[name]}\n" if name in MEMBERS else "")
        for name, home in homes.items()
    ]
    return "\n".join([*blocks, *(f"::: {name}\n" for name in MODULES)])
