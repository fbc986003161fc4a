"""Which controllers a firmware image holds: generator version and settings digest, from its bytes."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from mambo_codegen.errors import MamboNmpcError, echo
from mambo_codegen.plain_file import guess_name, read_plain_file
from mambo_codegen.settings import controller_toml
from mambo_codegen.settings.model import Settings

LARGEST_FILE_BYTES: Final = 256_000_000

_STRING: Final = re.compile(
    rb"mambo-nmpc ([0-9]+\.[0-9]+[0-9A-Za-z.+-]{0,36})(?: settings |\n)([0-9a-f]{16})(?:[\0\r\n]|\Z)"
)
"""What nmpc_version() returns, and what the firmware of `generate --for pil` answers, to the end of the line.

A version has two numbers or more, a digest 16 digits: other texts are of no controller.
"""
_HEX_LINE: Final = re.compile(rb":([0-9A-Fa-f]{2}){5,}\s*")
_DATA, _END, _SEGMENT, _LINEAR = 0, 1, 2, 4
_UF2_BLOCK_BYTES, _UF2_HEAD_BYTES, _UF2_MOST_BYTES = 512, 32, 476
_UF2_MAGIC: Final = (b"UF2\n", bytes.fromhex("57515d9e"))


class ImageError(MamboNmpcError):
    """A firmware image cannot be read; the message names file and line."""


@dataclass(frozen=True)
class HeldController:
    """A controller in an image.

    version:  of the generator that wrote its C.
    digest:   first 16 digits of its settings digest.
    settings: which of the given sources have that digest.
    """

    version: str
    digest: str
    settings: tuple[str, ...] = ()


def held_controllers(path: Path) -> tuple[HeldController, ...]:
    """Return the controllers in an image, in the order of their addresses, each once; raises ImageError.

    Reads ELF and plain binary as bytes, Intel HEX and UF2 by their addresses.
    """
    name = echo(str(path))
    try:
        content = read_plain_file(path, LARGEST_FILE_BYTES + 1)
    except OSError as error:
        raise ImageError(f"{name}: cannot be read: {error.strerror}{guess_name(path)}") from error
    if len(content) > LARGEST_FILE_BYTES:
        raise ImageError(f"{name}: is larger than 256 MB; name the image of one firmware")
    if not content:
        raise ImageError(f"{name}: is empty; build the firmware again")
    found = [match.groups() for memory in _memories(content, name) for match in _STRING.finditer(memory)]
    unique = dict.fromkeys(found)
    return tuple(HeldController(version.decode(), digest.decode()) for version, digest in unique)


def name_settings(
    held: tuple[HeldController, ...], sources: Mapping[str, Settings]
) -> tuple[HeldController, ...]:
    """Return the controllers with the sources that have their digest, also with another --scalar."""
    names: dict[str, list[str]] = {}
    for source, settings in sources.items():
        for name, variant in _variants(source, settings):
            names.setdefault(variant.short_digest, []).append(name)
    return tuple(replace(one, settings=tuple(names.get(one.digest, ()))) for one in held)


def missing(held: tuple[HeldController, ...], sources: Mapping[str, Settings]) -> tuple[str, ...]:
    """Return the sources whose settings no controller in an image has, with any --scalar."""
    digests = {one.digest for one in held}
    return tuple(
        source
        for source, settings in sources.items()
        if digests.isdisjoint(variant.short_digest for _, variant in _variants(source, settings))
    )


def _variants(source: str, settings: Settings) -> Iterator[tuple[str, Settings]]:
    """Yield settings and what `generate --scalar` makes of them, as far as they are valid, by name."""
    yield source, settings
    for scalar in ("float32", "float64", "fixed"):
        if scalar != settings.code.scalar:
            try:
                changed = controller_toml.with_option(settings, "code.scalar", scalar)
            except MamboNmpcError:
                continue
            yield f"{source} --scalar {scalar}", changed


def _memories(content: bytes, name: str) -> list[bytes]:
    """Return the contiguous pieces of memory in a file; an ELF or a plain binary is one piece."""
    if content.startswith(_UF2_MAGIC[0]) and content[4:8] == _UF2_MAGIC[1]:
        return _join(_uf2_pieces(content))
    lines = content.splitlines()
    if content.startswith(b":") and _HEX_LINE.fullmatch(lines[0]):
        return _join(_hex_pieces(lines, name))
    return [content]


def _uf2_pieces(content: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield address and bytes of each block."""
    for start in range(0, len(content) - _UF2_BLOCK_BYTES + 1, _UF2_BLOCK_BYTES):
        block = content[start : start + _UF2_BLOCK_BYTES]
        address, size = (int.from_bytes(block[at : at + 4], "little") for at in (12, 16))
        yield address, block[_UF2_HEAD_BYTES : _UF2_HEAD_BYTES + min(size, _UF2_MOST_BYTES)]


def _hex_pieces(lines: list[bytes], name: str) -> Iterator[tuple[int, bytes]]:
    """Yield address and bytes of each record of data; raises ImageError, which names the line."""
    base = 0
    for number, line in enumerate(lines, 1):
        if not line.strip():
            continue
        if not _HEX_LINE.fullmatch(line):
            raise ImageError(f"{name}: line {number}: is not a record of Intel HEX; copy the file again")
        record = bytes.fromhex(line.strip()[1:].decode())
        if len(record) != record[0] + 5 or sum(record) % 256:
            raise ImageError(
                f"{name}: line {number}: length or checksum of the record is wrong; copy the file again"
            )
        address, kind, value = int.from_bytes(record[1:3], "big"), record[3], record[4:-1]
        if kind == _END:
            return
        if kind == _DATA:
            yield base + address, value
        elif kind in (_SEGMENT, _LINEAR):
            base = int.from_bytes(value, "big") << (4 if kind == _SEGMENT else 16)
    raise ImageError(f"{name}: has no end record; it is cut off, copy the file again")


def _join(pieces: Iterator[tuple[int, bytes]]) -> list[bytes]:
    """Return the bytes of pieces by address, joined where one begins at the end of the one before."""
    joined: list[bytearray] = []
    end = -1
    for address, value in sorted(pieces):
        if address != end:
            joined.append(bytearray())
        joined[-1] += value
        end = address + len(value)
    return [bytes(piece) for piece in joined]


def identity_text(held: tuple[HeldController, ...], path: str) -> str:
    """Say which controllers an image holds, a line each; for none, why it may hold one all the same."""
    if not held:
        return (
            f"{path}: holds no version of a mambo-nmpc controller.\n"
            "Either no controller is linked, or the linker dropped nmpc_version() because nothing calls it:\n"
            "print it at the start of the firmware, and the image tells its settings."
        )
    return "\n".join(
        f"mambo-nmpc {one.version}, settings {one.digest}: "
        + (" = ".join(one.settings) or "of no preset or source named; name its controller.toml or bundle")
        for one in held
    )
