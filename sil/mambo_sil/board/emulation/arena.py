"""The memory that a program on an emulated core leaves free."""


class Arena:
    """Hands out the addresses from `start` to `end` in multiples of `alignment`; nothing is ever freed."""

    def __init__(self, start: int, end: int, alignment: int) -> None:
        self._alignment = alignment
        self._next = self._round_up(start)
        self._end = end

    @property
    def free_bytes(self) -> int:
        """Return the bytes left to allocate; negative if `start` already lies beyond `end`."""
        return self._end - self._next

    def allocate(self, size: int) -> int:
        """Allocate `size` bytes; returns their address."""
        address = self._next
        self._next += self._round_up(size)
        assert self.free_bytes >= 0
        return address

    def _round_up(self, size: int) -> int:
        return -(-size // self._alignment) * self._alignment
