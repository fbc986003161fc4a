"""What can go wrong while flying, one class per thing a caller would do differently."""

from mambo_nmpc.codegen.errors import MamboNmpcError


class TrajectoryError(MamboNmpcError):
    """A trajectory that cannot be flown; the message names file, line and rule."""


class ScenarioError(MamboNmpcError):
    """A file that holds no record of a flight; the message names file, key and rule."""


class FlightError(MamboNmpcError):
    """A flight that cannot be simulated as described."""


class TraceError(MamboNmpcError):
    """A file that holds no trace; the message names it."""


class ResultsError(MamboNmpcError):
    """A folder that holds no results of ours, or broken ones; the message names it and what was expected."""


class CacheError(MamboNmpcError):
    """The compile cache cannot be used, or others may write to it."""


class BusyError(MamboNmpcError):
    """Another run holds the result folder."""


class EmulatorError(MamboNmpcError):
    """A program cannot be emulated here: the emulator is missing, or the core too small for it."""


class EmulationError(MamboNmpcError):
    """The program on the emulated core died, or did not return in time."""


class WorkerError(MamboNmpcError):
    """Work given to other processes or machines did not come back."""


class StudyError(MamboNmpcError):
    """A study cannot be searched or kept: Optuna is missing, or the storage refuses."""
