"""The self-test of a bundle notices small faults of the C, except those with a reason.

python -m tests.mutation.test_self_test_mutants KIND ...   try every fault of kinds, print what goes unnoticed
"""

import sys
import zlib
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import pytest

from mambo_codegen.bundle.render import render
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from tests.mutation.mutants import Mutant, mutants
from tests.mutation.mutation import Fate
from tests.mutation.reasons import is_explained, survivors
from tests.mutation.self_test_bench import FILES, Noticed, SelfTestBench
from tests.support.height import EVERY_FUNCTION
from tests.support.one_norm import ONE_NORM
from tests.support.quadratic import EVERYTHING

REASONS = survivors("self_test_survivors.txt")
NO_BITS = REASONS | survivors("c_survivors.txt")
METHODS: Final = {
    "height": EVERY_FUNCTION,
    "plane": EVERYTHING,
    "one-norm": ONE_NORM,
    "tracked": presets.load("mambo-1norm"),
}
KINDS: Final[dict[str, Settings]] = {
    f"{name}-{scalar}": with_option(METHODS[name], "code.scalar", scalar, "test")
    for name, scalar in [
        *((name, "float32") for name in METHODS),
        *((name, "fixed") for name in ("one-norm", "tracked")),
    ]
}
STRIDE: Final = 40
"""The test tries one fault in so many, others when the C changes; all of them take half an hour."""


def unexplained(bench: SelfTestBench, tried: Sequence[Mutant]) -> Iterator[Mutant]:
    """Yield the faults that go unnoticed without a reason."""
    unknown = [one for one in tried if not is_explained(one.key, NO_BITS, bench.settings)]
    for one, noticed in bench.noticed(unknown).items():
        if noticed is Noticed.NEVER and bench.fate(one) is Fate.SURVIVED:
            yield one


@pytest.mark.sampled(2)
@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_the_self_test_notices_a_fault_or_a_reason_explains_it(kind: str, tmp_path: Path) -> None:
    """All episodes, with both methods, also in fixed point; the message has the survivors."""
    bench = SelfTestBench(KINDS[kind], tmp_path)
    found = bench.mutants()
    keys = [mutant.key for mutant in found if mutant.file == "nmpc.c"]  # the same in every version
    tried = found[zlib.crc32(repr(keys).encode()) % STRIDE :: STRIDE]
    assert [one.key for one in unexplained(bench, tried)] == []


@pytest.mark.long
def test_every_reason_of_the_self_test_is_of_a_fault_that_there_is() -> None:
    """A row whose line is gone is removed."""
    keys = {
        mutant.key
        for files in (render(settings, with_digest=False) for settings in KINDS.values())
        for path in FILES
        for mutant in mutants(path, files[path])
    }
    assert REASONS.keys() - keys == set()


def main() -> None:
    """Try every fault of the kinds of the command line, or of all."""
    for kind in sys.argv[1:] or KINDS:
        with TemporaryDirectory() as folder:
            bench = SelfTestBench(KINDS[kind], Path(folder))
            noticed = bench.noticed(bench.mutants())
            print(kind, {one.name: count for one, count in Counter(noticed.values()).items()}, flush=True)
            for one in unexplained(bench, [one for one, by in noticed.items() if by is Noticed.NEVER]):
                print(kind, " @@ ".join(one.key), one.wrong_line, flush=True)


if __name__ == "__main__":
    main()
