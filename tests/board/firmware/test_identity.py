"""`which-controller`: which controllers a firmware image holds."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from mambo_codegen import __version__
from mambo_codegen.bundle.render import render
from mambo_codegen.settings.controller_toml import to_toml, with_option
from mambo_codegen.settings.presets import preset
from mambo_sil.board.firmware.identity import held_controllers
from tests.support.command import run
from tests.support.linking import builder_with

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")

MAMBO = preset("mambo")
FIXED = with_option(MAMBO, "code.scalar", "fixed")
OWN = with_option(MAMBO, "cost.response_time_s", 0.3)


def version(digest: str) -> bytes:
    """Return the string that nmpc_version() returns."""
    return f"mambo-nmpc {__version__} settings {digest[:16]}".encode()


def intel_hex(content: bytes) -> bytes:
    """Return Intel HEX from address 0x0800fff8 on, 16 bytes a record, across a limit of 64 kB."""
    lines, base = [], -1
    for start in range(0, len(content), 8):
        address, value = 0x0800FFF8 + start, content[start : start + 8]
        if address >> 16 != base:
            base = address >> 16
            lines.append(bytes([2, 0, 0, 4]) + base.to_bytes(2, "big"))
        lines.append(bytes([len(value)]) + (address & 0xFFFF).to_bytes(2, "big") + bytes([0]) + value)
    records = [*lines, bytes([0, 0, 0, 1])]
    return b"".join(b":%s\n" % bytes([*r, -sum(r) % 256]).hex().upper().encode() for r in records)


def uf2(content: bytes) -> bytes:
    """Return UF2 with 32 bytes a block."""
    pieces = [(start, content[start : start + 32]) for start in range(0, len(content), 32)]
    return b"".join(
        b"UF2\n\x57\x51\x5d\x9e"
        + b"".join(n.to_bytes(4, "little") for n in (0, 0x10000000 + start, len(value), k, len(pieces), 0))
        + value.ljust(476, b"\0")
        + b"\x30\x6f\xb1\x0a"
        for k, (start, value) in enumerate(pieces)
    )


@pytest.mark.parametrize("form", [bytes, intel_hex, uf2])
def test_each_kind_of_image_tells_all_its_controllers(form: Callable[[bytes], bytes]) -> None:
    """Each once, in their order, though its string runs over records."""
    strings = [version(FIXED.digest), version(MAMBO.digest), version(MAMBO.digest)]
    Path("image").write_bytes(form(b"\0\x11".join([b"start of code", *strings, b""])))
    held = held_controllers(Path("image"))
    assert [(one.version, one.digest) for one in held] == [
        (__version__, FIXED.short_digest),
        (__version__, MAMBO.short_digest),
    ]


def test_presets_and_sources_are_named() -> None:
    """A preset with another scalar type, and the folder of a bundle."""
    Path("image").write_bytes(version(FIXED.digest) + b"\0" + version(OWN.digest))
    Path("mine").mkdir()
    Path("mine/controller.toml").write_text(to_toml(OWN), "utf-8")
    said, _ = run("which-controller", "image", "mine")
    assert said.splitlines() == [
        f"mambo-nmpc {__version__}, settings {FIXED.short_digest}: preset mambo --scalar fixed",
        f"mambo-nmpc {__version__}, settings {OWN.short_digest}: mine",
    ]
    unknown = json.loads(run("which-controller", "image", "--json")[0])["controllers"][1]
    assert unknown == {"version": __version__, "digest": OWN.short_digest, "settings": []}
    assert "of no preset or source named" in run("which-controller", "image")[0]


def test_an_image_without_the_settings_given_fails() -> None:
    """Whatever else it holds; a preset that nobody named is not missed."""
    Path("image").write_bytes(version(FIXED.digest))
    assert run("which-controller", "image", "mambo")[1] == ""
    assert run("which-controller", "image", "mambo", "crazyflie", code=1)[1] == (
        "image: does not hold the settings of crazyflie\n"
    )
    assert json.loads(run("which-controller", "image", "table1", "--json", code=1)[0])["missing"] == [
        "table1"
    ]


@pytest.mark.parametrize(
    "text",
    [
        f"mambo-nmpc {__version__} settings {MAMBO.digest}",
        f"mambo-nmpc {__version__} settings {MAMBO.short_digest[:15]}",
        f"mambo-nmpc {__version__} settings {MAMBO.short_digest} of the manual",
        f"mambo-nmpc VERSION settings {MAMBO.short_digest}",
        f"mambo-nmpc 1 settings {MAMBO.short_digest}",
        f"mambo-nmpc {__version__}\n{MAMBO.short_digest}x\n",
    ],
)
def test_a_text_that_looks_like_a_version_is_no_controller(text: str) -> None:
    """Another length of the digest, no version, or a sentence."""
    Path("image").write_bytes(text.encode() + b"\0code")
    assert held_controllers(Path("image")) == ()
    run("which-controller", "image", code=1)


def test_the_greeting_of_a_board_is_found() -> None:
    """It holds generator and digest in lines of text."""
    Path("image").write_bytes(f"\x01mambo-nmpc {__version__}\n{MAMBO.short_digest}\nfloat32\n".encode())
    assert [one.digest for one in held_controllers(Path("image"))] == [MAMBO.short_digest]


@pytest.mark.first_is_quick
@pytest.mark.parametrize("calls", [True, False])
def test_a_linked_controller_is_found_if_its_version_is_called(calls: bool) -> None:
    """Else the linker drops the string, exit 1, and the command says so."""
    call = "nmpc_version()[0]" if calls else "sizeof instance"
    run_body = f"{{ nmpc_init(&instance); return (int)({call}); }}"
    glue = f'#include "nmpc.h"\nnmpc_t instance;\nint run(void);\nint run(void) {run_body}\n'
    firmware = builder_with("crazyflie").guest(
        render(MAMBO, with_digest=False), glue, ("run",), Path("build")
    )
    said, _ = run("which-controller", str(firmware), code=0 if calls else 1)
    assert said.endswith(": preset mambo\n") if calls else "nothing calls it" in said


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "image: is empty; build the firmware again\n"),
        (b":00000001FE\n", "image: line 1: length or checksum of the record is wrong; copy the file again\n"),
        (b":0100000000FF\n", "image: has no end record; it is cut off, copy the file again\n"),
        (b":0100000000FF\n:0\n", "image: line 2: is not a record of Intel HEX; copy the file again\n"),
    ],
)
def test_a_damaged_image_is_refused(content: bytes, said: str) -> None:
    """With its fault and what to do, not as one without a controller."""
    Path("image").write_bytes(content)
    assert run("which-controller", "image", code=2)[1] == said


def test_a_folder_without_settings_is_refused() -> None:
    """With the file that is missing."""
    Path("image").write_bytes(version(MAMBO.digest))
    Path("empty").mkdir()
    assert run("which-controller", "image", "empty", code=2)[1] == (
        "empty: is a folder without controller.toml; name a settings file, or the folder of a bundle\n"
    )
