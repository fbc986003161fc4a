"""How a flight can end before its time; the text of each says why."""


class RefusedError(Exception):
    """No flight begins."""


class TroubleError(Exception):
    """A flight must end."""


class CannotLandError(TroubleError):
    """A flight must end by stopping the motors."""


class LinkLostError(Exception):
    """The radio link is lost."""
