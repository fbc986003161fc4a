"""The table of the port against the structs that a compiler makes of nmpc.h."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from mambo_codegen.bundle.render import render
from mambo_codegen.methods import method_of
from mambo_codegen.port.port import ControllerPort
from mambo_codegen.port.row import NUMBER, WHOLE
from mambo_sil.flight.controllers.controller_library import with_default_prefix
from tests.support.options import OPTIONS
from tests.support.tools import toolchain


def kept_numbers(port: ControllerPort, record: str, before: str = "") -> Iterator[str]:
    """Yield where each number of a record and of those inside is, in C, in the order of the table."""
    for row in port.rows(record):
        for axis in range(port.count(row)):
            place = before + row.member + ("" if row.count == 1 else f"[{axis}]")
            if row.kind == NUMBER:
                yield place
            elif row.kind not in (WHOLE, "unsigned char", "nmpc_sum_t"):
                yield from kept_numbers(port, row.kind, f"{place}.")


@pytest.mark.sampled(3)
@pytest.mark.parametrize("name", OPTIONS)
def test_numbers_lie_where_the_table_has_them(name: str, tmp_path: Path) -> None:
    """Of what is taken one behind the other, integers last; with a quadratic cost of what is kept too."""
    settings = with_default_prefix(OPTIONS[name].settings)
    port, claims = method_of(settings).port, list[str]()
    taken = ["state", "target", "command", *["limits"] * ("limits" in port.parts)]
    taken += ["estimate"] if settings.controller.method == "quadratic" else ["weights"]
    for record in taken:
        numbers = port.numbers(record)
        claims += [
            f"offsetof(nmpc_{record}_t, {one.member}) == {one.column}U * sizeof(nmpc_real_t)"
            for one in numbers
        ]
        size = len(numbers) if port.wholes(record) else len(port.reals(record))
        claims.append(f"sizeof(nmpc_{record}_t) == {size}U * sizeof(nmpc_real_t)")
    if settings.controller.method == "quadratic":
        places = list(kept_numbers(port, "controller"))
        claims += [
            f"offsetof(nmpc_t, {place}) == {column}U * sizeof(nmpc_real_t)"
            for column, place in enumerate(places)
        ]
        claims += [f"NMPC_STORED_NUMBERS == {len(places)}", "sizeof(nmpc_t) == NMPC_INSTANCE_BYTES"]
        claims.append(f"offsetof(nmpc_t, steps_blind) == {len(places)}U * sizeof(nmpc_real_t)")
    (tmp_path / "nmpc.h").write_text(render(settings, with_digest=False)["nmpc.h"])
    asserted = [f"typedef char claim_{k}[({claim}) ? 1 : -1];" for k, claim in enumerate(claims)]
    text = '#include <stddef.h>\n#include "nmpc.h"\n' + "\n".join(asserted) + "\n"
    (tmp_path / "claims.c").write_text(text)
    toolchain("gcc").run(["-std=c99", "-fsyntax-only", "-I.", "claims.c"], tmp_path)
