"""Requirements of every sensor: a name, and valid values for the conversion to volts."""

from math import isfinite

from vibench.acquisition.instruments import PlugInKind
from vibench.acquisition.rig import Rig, channels_of

KIND = PlugInKind.SENSOR


def test_a_sensor_channel_has_a_name_a_sensitivity_and_a_range(rig: Rig) -> None:
    for channel in channels_of(rig):
        assert channel.sensor
        assert isfinite(channel.units_per_volt)
        assert channel.units_per_volt > 0
        assert channel.full_scale_v > 0
        assert channel.delay_s >= 0
