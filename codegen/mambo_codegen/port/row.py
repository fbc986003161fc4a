"""A row of the port: what everything that lists the numbers of a controller has to know of one of them."""

from dataclasses import dataclass
from typing import Final

NUMBER: Final = "nmpc_real_t"
SUM: Final = "nmpc_sum_t"
BYTE: Final = "unsigned char"
WHOLE: Final = "int"
"""The types of members in C; any other is a record of the table."""

RANGES: Final = {
    "position": "NMPC_POSITION_RANGE_M",
    "velocity": "NMPC_VELOCITY_RANGE_M_S",
    "angle": "NMPC_ATTITUDE_RANGE_RAD",
    "yaw": "NMPC_YAW_RANGE_RAD",
    "thrust": "NMPC_THRUST_ACCELERATION_MAX_M_S2",
}
"""The largest magnitude of what a controller takes, in C, by quantity."""

SIGNED: Final = "signed"
SHARE: Final = "share"


@dataclass(frozen=True)
class Draw:
    """What the self-test draws for a number: an integer with a sign times a scale, or what its way says.

    scale:   the name of the scale, NMPC_SELF_TEST_NAME in C.
    largest: of the scale in SI units; None where the settings say it.
    way:     SIGNED, or SHARE, without a sign. Without a scale: of AIM, where the target is; of BESIDE, near
             the target's member of the same name; of CHANCE, 1 in one input of eight, else 0;
             of COUNT, 0 to 2, or, in one of 32, a 3 or -1, which is refused.
    rests:   whether it is 0 of a drone that is at its target.
    """

    scale: str = ""
    largest: float | None = None
    way: str = SIGNED
    rests: bool = False


AIM: Final = Draw(way="aim")
BESIDE: Final = Draw(way="beside")
CHANCE: Final = Draw(way="chance")
COUNT: Final = Draw(way="count")


@dataclass(frozen=True)
class PortRow:
    """A member of a record: a number, several of one kind, or a record inside it.

    member:   its name in C, with the unit.
    quantity: what fixed point has a format for; none of a record or of an integer that is kept.
    words:    what it is, for its comment in nmpc.h; NAMES in braces stand for what depends on the settings.
    count:    how many there are: 2 along x and y; or the constant of nmpc.h that says it.
    when:     the parts of the controller without which it is not there.
    kind:     its type in C: NUMBER, SUM, BYTE, WHOLE, or the record that it is.
    unit:     where the name has none.
    note:     what its comment says behind the range.
    draw:     what the self-test draws for it; None of what is not taken.
    reset:    what nmpc_init() makes of a command's, a constant of nmpc.h; 0 without.
    told:     of each number the name and the description as a variable of a functional mock-up unit.
    """

    member: str
    quantity: str = ""
    words: str = ""
    count: int | str = 1
    when: tuple[str, ...] = ()
    kind: str = NUMBER
    unit: str = ""
    note: str = ""
    draw: Draw | None = None
    reset: str = ""
    told: tuple[tuple[str, str], ...] = ()

    @property
    def is_upward(self) -> bool:
        """Whether it belongs to the height, and not to the level axes or the drone as a whole."""
        return "height" in self.when


@dataclass(frozen=True)
class Number:
    """A single number of a record.

    member: in C, such as position_m[1].
    axis:   its place in the row.
    column: its place among the numbers of the record.
    """

    row: PortRow
    axis: int
    member: str
    column: int

    @property
    def quantity(self) -> str:
        """What fixed point has a format for."""
        return self.row.quantity

    @property
    def is_whole(self) -> bool:
        """Whether it is an integer, which has no format."""
        return self.row.kind == WHOLE

    @property
    def told(self) -> tuple[str, str]:
        """Name and description of a variable; without any in the row made of the member's and its words."""
        if self.row.told:
            return self.row.told[self.axis]
        name = self.member.replace("[", "_").rstrip("]")
        return name, self.row.words or name

    @property
    def range(self) -> str:
        """Its largest magnitude in C if a controller takes it; none of what has no range."""
        return RANGES.get(self.row.quantity, "")


Table = dict[str, tuple[PortRow, ...]]
"""The rows of each record, nmpc_NAME_t in C; `controller` is nmpc_t."""
