from ._configuration import (
    HIGH_Z as HIGH_Z,
    LARGEST_LEVEL_ERROR as LARGEST_LEVEL_ERROR,
    TOKEN_KEY as TOKEN_KEY,
    TOKEN_VARIABLE as TOKEN_VARIABLE,
    USUAL_GRID_RATE_HZ as USUAL_GRID_RATE_HZ,
    AccelerometerConfig as AccelerometerConfig,
    ChannelConfig as ChannelConfig,
    ControllerConfig as ControllerConfig,
    DaqConfig as DaqConfig,
    GeneratorConfig as GeneratorConfig,
    OutputConfig as OutputConfig,
    OutputUse as OutputUse,
    Rig as Rig,
    Role as Role,
    StatedUncertainty as StatedUncertainty,
    VibrometerConfig as VibrometerConfig,
    VirtualConfig as VirtualConfig,
    fastest_sample_rate_hz as fastest_sample_rate_hz,
    given_token as given_token,
    highest_carried_hz as highest_carried_hz,
)
from ._knobs import (
    CalibrationRule as CalibrationRule,
    Confirm as Confirm,
    KnobSheet as KnobSheet,
    calibrations as calibrations,
    check_calibrations as check_calibrations,
    confirm_at_terminal as confirm_at_terminal,
    confirm_by_sheet as confirm_by_sheet,
    confirm_simulated as confirm_simulated,
    save_knob_sheet as save_knob_sheet,
)
from ._load_rig import (
    ControllerDriver as ControllerDriver,
    GeneratorDriver as GeneratorDriver,
    controller_driver as controller_driver,
    digitizer_driver as digitizer_driver,
    generator_driver as generator_driver,
    load_rig as load_rig,
    output_driver as output_driver,
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
from ._sensitivity import (
    volts_per_unit as volts_per_unit,
)
from ._sensors import (
    Channel as Channel,
    accelerometer as accelerometer,
    channels_of as channels_of,
    sensor_name as sensor_name,
    vibrometer as vibrometer,
    wire as wire,
)
