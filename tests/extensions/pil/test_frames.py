"""Frames: Python and the generated C agree, and no damage goes unnoticed."""

import random
import subprocess
from pathlib import Path
from typing import Any

import cffi
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mambo_codegen.bundle.flags import COMPILE_FLAGS, WARNING_FLAGS
from mambo_codegen.settings import presets
from mambo_extensions.pil.protocol import (
    LONGEST_PAYLOAD,
    LONGEST_STUFFED,
    Receiver,
    decode,
    encode,
    frame_bytes,
)
from tests.support.bundles import write_target
from tests.support.tools import require

payloads = st.binary(min_size=1, max_size=LONGEST_PAYLOAD) | st.lists(
    st.sampled_from([0, 1, 255]), min_size=1, max_size=LONGEST_PAYLOAD
).map(bytes)


@given(payloads)
def test_a_frame_brings_its_payload(payload: bytes) -> None:
    """No zero between its delimiters, and always the same overhead."""
    frame = encode(payload)
    assert len(frame) == frame_bytes(len(payload))
    assert frame.count(0) == 2
    assert decode(frame[1:-1]) == payload


@given(payloads, st.integers(0, 8 * LONGEST_STUFFED - 1))
def test_a_flipped_bit_is_seen(payload: bytes, bit: int) -> None:
    """Any bit: of the payload, of the CRC, of the stuffing."""
    stuffed = bytearray(encode(payload)[1:-1])
    stuffed[bit // 8 % len(stuffed)] ^= 1 << bit % 8
    assert [found for found in Receiver().feed(b"\0" + stuffed + b"\0") if found is not None] == []


@given(st.lists(payloads, max_size=5), st.lists(st.integers(1, 40), min_size=1))
def test_frames_come_out_however_the_stream_is_cut(sent: list[bytes], cuts: list[int]) -> None:
    """Also with noise in front, which is one damaged frame."""
    stream, receiver, found = b"\x07noise" + b"".join(map(encode, sent)), Receiver(), []
    place = 0
    while place < len(stream):
        size = cuts[place % len(cuts)]
        found += receiver.feed(stream[place : place + size])
        place += size
    assert [payload for payload in found if payload is not None] == sent
    assert found.count(None) == (1 if sent else 0)


def test_endless_noise_is_not_kept() -> None:
    """A frame that is too long is damaged, and the next one is whole."""
    receiver = Receiver()
    for _ in range(100):
        assert receiver.feed(b"x" * 1000) == []
    assert receiver.feed(encode(b"after")) == [None, b"after"]


def test_a_payload_that_is_too_long_is_a_mistake() -> None:
    """The buffers on the board are not longer."""
    with pytest.raises(ValueError, match=f"at most {LONGEST_PAYLOAD} bytes, not {LONGEST_PAYLOAD + 1}"):
        encode(bytes(LONGEST_PAYLOAD + 1))


@pytest.fixture(scope="module", params=["gcc", "clang"])
def frames_c(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Return the generated C of frames, compiled with strict warnings as errors."""
    compiler = require(request.param, request.param)
    folder = write_target("pil", presets.preset("mambo"), tmp_path_factory.mktemp("frames"))
    flags = [*COMPILE_FLAGS, *WARNING_FLAGS, "-Werror", "-fPIC", "-shared"]
    line = [compiler, *flags, "pil_frame.c", "-o", "frames.so"]
    done = subprocess.run(line, cwd=folder, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    ffi = cffi.FFI()
    ffi.cdef(
        "uint16_t pil_stuff(uint8_t *frame, uint16_t count);"
        "uint16_t pil_unstuff(uint8_t *frame, uint16_t count);"
    )
    return ffi, ffi.dlopen(str(Path(folder) / "frames.so"))


def test_the_c_stuffs_and_restores_as_python_does(frames_c: Any) -> None:
    """Random payloads of every length, with many zeros and without, whole and damaged."""
    ffi, library = frames_c
    draw = random.Random(0)
    damaged = 0
    for case in range(4000):
        length = 1 + case % LONGEST_PAYLOAD
        values = [0, 0, 1, 255] if case % 3 == 0 else range(256)
        payload = bytes(draw.choices(values, k=length))
        frame = ffi.new(f"uint8_t[{LONGEST_STUFFED}]", b"\xa5" + payload)
        count = library.pil_stuff(frame, length)
        stuffed = bytearray(ffi.buffer(frame, count))
        assert bytes(stuffed) == encode(payload)[1:-1]
        for _ in range(case % 4):
            stuffed[draw.randrange(count)] = draw.randrange(1, 256)
        ffi.buffer(frame, count)[:] = bytes(stuffed)
        expected = decode(bytes(stuffed))
        found = library.pil_unstuff(frame, count)
        assert found == len(expected or b"")
        assert bytes(ffi.buffer(frame, 1 + found))[1:] == (expected or b"")
        damaged += expected is None
    assert damaged > 2000
