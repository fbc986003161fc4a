"""The names on the page of the Python API: the docstrings of the public names of `mambo_nmpc`."""

import enum
import importlib
import inspect
from collections.abc import Iterator
from typing import Any, Final

import mambo_nmpc
from docs.pages.tables import plain

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


def python_text() -> str:
    """Return the same as Markdown for a source host: signatures and docstrings, methods too."""
    names = [(name, getattr(mambo_nmpc, name)) for name in mambo_nmpc.__all__]
    modules = [importlib.import_module(name) for name in MODULES]
    more = [(name, getattr(one, name)) for one in modules for name in one.__all__]
    return "\n".join(line for name, one in (*names, *more) for line in _described(name, one, "##"))


def _described(name: str, one: Any, level: str) -> Iterator[str]:
    """Yield the lines on a name: heading, signature, docstring, then those of its public methods."""
    is_called = callable(one) and not (isinstance(one, type) and issubclass(one, BaseException | enum.Enum))
    called = f"{name.rpartition('.')[2]}{_signature(one)}" if is_called else ""
    said = inspect.cleandoc(getattr(one, "__doc__", None) or "")
    yield f"{level} {name}\n"
    text = "\n\n".join(filter(None, (called, said)))
    yield f"```text\n{text}\n```\n"
    if not isinstance(one, type) or issubclass(one, BaseException):
        return
    chosen = MEMBERS.get(name, [key for key in vars(one) if not key.startswith("_")])
    for key in chosen:
        member = inspect.getattr_static(one, key)
        function = member.fget if isinstance(member, property) else getattr(member, "__func__", member)
        if not inspect.isfunction(function) or not function.__doc__:
            continue
        if isinstance(member, property):
            yield f"**`{name}.{key}`**: {plain(inspect.cleandoc(function.__doc__))}\n"
        else:
            yield from _described(f"{name}.{key}", function, f"{level}#")


def _plain_default(parameter: inspect.Parameter) -> inspect.Parameter:
    """Return a parameter whose default is not a function, which has another address in each run."""
    return parameter.replace(default=...) if inspect.isfunction(parameter.default) else parameter


def _signature(one: Any) -> str:
    """Return the parameters of a function or class, one on a line where they are many, without types."""
    try:
        parameters = inspect.signature(one).parameters.values()
    except ValueError:
        return "(...)"
    shown = [str(_plain_default(each).replace(annotation=inspect.Parameter.empty)) for each in parameters]
    shown = [word.replace("Ellipsis", "...") for word in shown if word not in {"self", "cls"}]
    return f"({', '.join(shown)})"
