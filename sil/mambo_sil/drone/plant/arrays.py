"""Array types that the modules of the simulation share; n is the number of flights."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]

PerFlight: TypeAlias = float | FloatArray
"""One value for all flights, or an array (n,) with one value for each."""
