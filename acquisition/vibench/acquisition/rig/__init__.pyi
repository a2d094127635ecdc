from ._calibration import (
    CalibrationRule as CalibrationRule,
    calibrations as calibrations,
    check_calibrations as check_calibrations,
)
from ._channel import (
    Channel as Channel,
    channels_of as channels_of,
)
from ._configuration import (
    HIGH_Z as HIGH_Z,
    AccelerometerConfig as AccelerometerConfig,
    ChannelConfig as ChannelConfig,
    ControllerConfig as ControllerConfig,
    DaqConfig as DaqConfig,
    GeneratorConfig as GeneratorConfig,
    Rig as Rig,
    Role as Role,
    StatedUncertainty as StatedUncertainty,
    VibrometerConfig as VibrometerConfig,
)
from ._drivers import (
    ControllerDriver as ControllerDriver,
    GeneratorDriver as GeneratorDriver,
    controller_driver as controller_driver,
    digitizer_driver as digitizer_driver,
    generator_driver as generator_driver,
    output_driver as output_driver,
)
from ._knobs import (
    Confirm as Confirm,
    KnobSheet as KnobSheet,
    confirm_at_terminal as confirm_at_terminal,
    confirm_by_sheet as confirm_by_sheet,
    confirm_simulated as confirm_simulated,
    save_knob_sheet as save_knob_sheet,
)
from ._load_rig import (
    load_rig as load_rig,
    with_faults as with_faults,
)
from ._model import (
    BaseQuantity as BaseQuantity,
    ComplexArray as ComplexArray,
    OnTable as OnTable,
    RigModel as RigModel,
    amplifier_of as amplifier_of,
    shaker_of as shaker_of,
    specimen_of as specimen_of,
    suspended_mass_kg as suspended_mass_kg,
)
from ._output import (
    OutputConfig as OutputConfig,
    OutputUse as OutputUse,
)
from ._sensitivity import (
    volts_per_unit as volts_per_unit,
)
from ._sensors import (
    accelerometer as accelerometer,
    sensor_name as sensor_name,
    vibrometer as vibrometer,
    wire as wire,
)
from ._virtual import (
    LARGEST_LEVEL_ERROR as LARGEST_LEVEL_ERROR,
    TOKEN_KEY as TOKEN_KEY,
    TOKEN_VARIABLE as TOKEN_VARIABLE,
    USUAL_GRID_RATE_HZ as USUAL_GRID_RATE_HZ,
    VirtualConfig as VirtualConfig,
    fastest_sample_rate_hz as fastest_sample_rate_hz,
    given_token as given_token,
    highest_carried_hz as highest_carried_hz,
)
