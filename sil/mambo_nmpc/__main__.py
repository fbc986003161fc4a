"""Entry point of `mambo-nmpc` and `python -m mambo_nmpc`; no signal shows a traceback at any time."""

import os
import signal
import sys


def main() -> None:
    """Run the command line; before a command runs Ctrl-C exits with 130 and SIGTERM with 143, at once."""
    signal.signal(signal.SIGTERM, lambda *_: os._exit(143))
    try:
        from mambo_sil.cli import app  # noqa: PLC0415 - Ctrl-C during the import must exit with 130

        app.main()
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":
    main()
