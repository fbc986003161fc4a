"""Entry point of `mambo-nmpc` and `python -m mambo_nmpc`: Ctrl-C exits without a traceback at any time."""

import sys


def main() -> None:
    """Run the command line; Ctrl-C exits with 130, also while modules are still being imported."""
    try:
        from mambo_nmpc.sil.cli import app  # noqa: PLC0415 - importing takes long enough to be interrupted

        app.main()
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":
    main()
