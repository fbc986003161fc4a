"""Entry point of `mambo-nmpc` and `python -m mambo_nmpc`; no signal shows a traceback at any time."""

import gc
import os
import signal
import sys
from typing import Final

_COLLECTION: Final = 50_000
"""New objects after which Python looks for garbage; imports make tens of thousands, all of them in use."""


def main() -> None:
    """Run the command line; before a command runs Ctrl-C exits with 130 and SIGTERM with 143, at once."""
    gc.set_threshold(_COLLECTION)
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "1")  # pydantic reads the metadata of every package
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # threads cost more than such small matrices
    signal.signal(signal.SIGTERM, lambda *_: os._exit(143))
    try:
        from mambo_sil.cli import app  # noqa: PLC0415 - Ctrl-C during the import must exit with 130

        app.main()
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":
    main()
