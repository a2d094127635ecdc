from ._linear_motion import (
    SINE_COLUMNS as SINE_COLUMNS,
    LinearMotion as LinearMotion,
    linear_motion as linear_motion,
)
from ._loaded_shaker import (
    MOTION_COLUMNS as MOTION_COLUMNS,
    LoadedShaker as LoadedShaker,
    MotionFailed as MotionFailed,
    ShakenMotion as ShakenMotion,
)
from ._parts import (
    Amplifier as Amplifier,
    Shaker as Shaker,
)
from ._sampled_voltage import (
    DrivenTable as DrivenTable,
    SampledMotion as SampledMotion,
    follow_voltage as follow_voltage,
)
