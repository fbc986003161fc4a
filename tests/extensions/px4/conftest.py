"""The module of PX4 flies on the Crazyflie's desk: without that extension it is compiled only."""

from importlib.util import find_spec
from typing import Final

collect_ignore: Final = (
    []
    if find_spec("mambo_extensions.crazyflie")
    else ["test_px4.py", "test_px4_companion.py", "test_px4_parameters.py"]
)
