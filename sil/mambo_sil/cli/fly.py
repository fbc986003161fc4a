"""The command `fly`: one simulated flight, or the repetition of a recorded one."""

from mambo_sil.cli.options import FlyOptions


def fly(options: FlyOptions) -> None:
    """Simulate one flight; write trace, metrics and plots; exit 1 if the drone crashes."""
    if options.repeat is not None:
        from mambo_sil.cli.repeat import fly_again

        fly_again(options, options.repeat)
    elif options.port is not None:
        from mambo_sil.cli.port import fly_on_port

        fly_on_port(options, options.port)
    else:
        from mambo_sil.cli.flight import fly_once

        fly_once(options)
