"""Fixtures for all tests, and the skip of those that want a compiler where there is none."""

import gc
import os
import sys
from collections import Counter
from collections.abc import Generator, Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from mambo_codegen.errors import BuildError
from tests.support.tools import require

GOLDEN_SECTION = 0.6180339887498949

# Arrays of tests are small: threads of NumPy's linear algebra take processor time from the other workers.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# Hundreds of tests start Python: each would compile all modules again, a second of processor time.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

# Tests are thousands of objects that stay: looking for garbage as often as usual takes a tenth of the time.
gc.set_threshold(50_000)

settings.register_profile(
    "house", derandomize=True, database=None, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("house")


@pytest.hookimpl(tryfirst=True)  # before the marks select
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the cases of a test that says `first_is_quick` or `sampled`; the first case is always run.

    The sample takes every n-th case at golden sections, so that no column of a table of cases is left out.
    """
    earlier = Counter[str]()
    for item in items:
        function = item.nodeid.partition("[")[0]
        index = earlier[function]
        earlier[function] += 1
        if index > 0 and item.get_closest_marker("first_is_quick"):
            item.add_marker("long")
        sampled = item.get_closest_marker("sampled")
        if sampled and index * GOLDEN_SECTION % 1 >= 1 / sampled.args[0]:
            item.add_marker("long")
            item.add_marker("thorough")


@pytest.fixture(scope="session", autouse=True)
def _own_environment() -> Iterator[None]:
    """Keep builds out of the user's compile cache, in one for all workers and runs, and hide an outer make.

    What it holds is named by the hash of all that made it; `make clean` removes it.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(Path(__file__).parents[1] / "build" / "tests-cache"))
        for name in ("MAKEFLAGS", "MAKELEVEL", "MFLAGS"):
            patch.delenv(name, raising=False)
        yield


@pytest.fixture
def in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run the test in a folder of its own."""
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def empty_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Give the test a cache folder of its own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "mambo-nmpc"


def _skip_without_compiler() -> Generator[None, object, object]:
    """Skip a test that builds with the host's compiler, or fail it where CI is true, if there is none."""
    try:
        return (yield)
    except (AssertionError, BuildError) as error:  # a command's own test asserts that stderr is empty
        if "no C compiler found" in str(error):
            require("cc", "gcc")
        raise


pytest_runtest_setup = pytest.hookimpl(wrapper=True)(_skip_without_compiler)
pytest_runtest_call = pytest.hookimpl(wrapper=True)(_skip_without_compiler)
