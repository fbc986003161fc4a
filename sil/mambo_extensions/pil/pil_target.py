"""The firmware of the processor in the loop as a target of `generate --for`."""

from typing import Final

from mambo_codegen.bundle.targets import FirmwareTarget
from mambo_codegen.methods import method_of
from mambo_codegen.settings.model import Settings


def _context(settings: Settings) -> dict[str, object]:
    """Return the longest payload, for the inputs of a step behind its head."""
    method = method_of(settings)
    numbers = len(method.port.numbers("state")) + len(method.port.numbers("target")) + 1
    return {"pil_payload_bytes": 128 if 5 + (numbers * method.numbers.bytes[0]) <= 128 else 200}


TARGET: Final = FirmwareTarget("pil", "mambo", "", context=_context)
