"""The command `fly`: one flight on the model of the Mambo, or a recorded one again."""

from mambo_nmpc.sil.cli.options import FlyOptions


def fly(options: FlyOptions) -> None:
    """Fly once on the model of the Mambo: trace, metrics and pictures."""
    if options.replay is not None:
        from mambo_nmpc.sil.cli.replay import fly_again

        fly_again(options, options.replay)
    else:
        from mambo_nmpc.sil.cli.flight import fly_once

        fly_once(options)
