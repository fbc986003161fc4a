"""What can go wrong while flying, one class per thing a caller would do differently."""

from codegen.errors import MamboNmpcError


class BuildError(MamboNmpcError):
    """The C cannot be compiled here: no compiler, no Python headers, or the compiler refused."""


class CacheError(MamboNmpcError):
    """The compile cache cannot be used, or others may write to it."""
