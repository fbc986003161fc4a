"""Names for the arrays that pass between the modules of the simulation."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]

PerFlight: TypeAlias = float | FloatArray
"""One value for all flights, or one for each (n,)."""
