"""Call a function in a process of its own, since the firmware can be started only once in a process."""

import multiprocessing
from collections.abc import Callable, Iterable
from typing import TypeVar

Given = TypeVar("Given")
Returned = TypeVar("Returned")


def each_in_a_process(function: Callable[[Given], Returned], given: Iterable[Given]) -> list[Returned]:
    """Return what `function` returns for each of `given`, one after the other."""
    with multiprocessing.get_context("fork").Pool(1, maxtasksperchild=1) as pool:
        return pool.map(function, given, chunksize=1)
