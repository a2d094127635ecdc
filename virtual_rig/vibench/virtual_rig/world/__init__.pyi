from ._time_grid import (
    FULL_BAND_HZ as FULL_BAND_HZ,
    relative_clock_ppm as relative_clock_ppm,
)
from ._world import (
    World as World,
    virtual_section as virtual_section,
)
