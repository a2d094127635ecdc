"""Setting up the inputs of a converter as the configuration says, and reading back that it is so."""

from collections.abc import Sequence

from nidaqmx import DaqError, Task
from nidaqmx.constants import Coupling, ExcitationSource, ExcitationVoltageOrCurrent, TerminalConfiguration
from nidaqmx.task.channels import AIChannel

from ..errors import SettingRefused
from ..rig import Channel, ChannelConfig
from ._daqmx_errors import NOT_OFFERED

_TERMINALS = {
    "default": TerminalConfiguration.DEFAULT,
    "pseudo_differential": TerminalConfiguration.PSEUDO_DIFF,
    "differential": TerminalConfiguration.DIFF,
    "single_ended": TerminalConfiguration.RSE,
}
_COUPLINGS = {"AC": Coupling.AC, "DC": Coupling.DC}
_SAME = 1e-6
# Beyond this, a scaling is bent or shifted by more than rounding: volts are no multiples of one step.
_LINEAR = 1e-9
# One count of an int32 marks lost samples in recordings: a 32-bit converter may use it for a voltage.
_MOST_COUNTS = 2**29


def add_input(task: Task, config: ChannelConfig, channel: Channel) -> float | None:
    """Add one input to a task, named by its role; return its volts per count where these scale linearly.

    Raises
    ------
    SettingRefused
        When coupling or sensor current read back differently.
    DaqError
        When the device refuses a setting.

    """
    task.ai_channels.add_ai_voltage_chan(
        channel.physical,
        name_to_assign_to_channel=channel.role.value,
        terminal_config=_TERMINALS[config.terminal],
        min_val=-channel.range_v,
        max_val=channel.range_v,
    )
    made = task.ai_channels[channel.role.value]
    _excite(made, channel)
    _couple(made, channel)
    return _volts_per_count(made, channel.range_v)


def _excite(made: AIChannel, channel: Channel) -> None:
    if channel.iepe_current_a > 0:
        made.ai_excit_src = ExcitationSource.INTERNAL
        made.ai_excit_voltage_or_current = ExcitationVoltageOrCurrent.USE_CURRENT
        made.ai_excit_val = channel.iepe_current_a
        held_a = made.ai_excit_val
        if abs(held_a - channel.iepe_current_a) > _SAME * channel.iepe_current_a:
            raise _refused(channel, "sensor current", f"{channel.iepe_current_a:g} A", f"{held_a:g} A")
        return
    try:
        # A current that an earlier program left on would push the vibrometer's output.
        made.ai_excit_src = ExcitationSource.NONE
    except DaqError as error:
        if error.error_type not in NOT_OFFERED:
            raise


def _couple(made: AIChannel, channel: Channel) -> None:
    wanted = _COUPLINGS[channel.coupling]
    try:
        made.ai_coupling = wanted
        held = made.ai_coupling
    except DaqError as error:
        # A device that cannot couple otherwise is coupled to DC.
        if error.error_type in NOT_OFFERED and wanted is Coupling.DC:
            return
        raise
    if held is not wanted:
        raise _refused(channel, "coupling", wanted.name, held.name)


def _volts_per_count(made: AIChannel, range_v: float) -> float | None:
    try:
        return linear_step_v([float(each) for each in made.ai_dev_scaling_coeff], range_v)
    except DaqError as error:
        if error.error_type in NOT_OFFERED:
            return None
        raise


def linear_step_v(coefficients: Sequence[float], range_v: float) -> float | None:
    """Step of a converter [V]; None when volts are not simply multiples of one step.

    A calibrated device may scale with an offset or a curve; its volts are then recorded as they come.
    ``coefficients`` are those of the polynomial from counts to volts, constant term first.
    """
    if len(coefficients) < 2 or not coefficients[1] * _MOST_COUNTS > range_v:
        return None
    step = coefficients[1]
    rest_v = [abs(each) * (range_v / step) ** power for power, each in enumerate(coefficients) if power != 1]
    return step if max(rest_v) <= _LINEAR * range_v else None


def _refused(channel: Channel, what: str, sent: str, got: str) -> SettingRefused:
    return SettingRefused(
        f"{channel.physical}: {what} was set to {sent} and reads back {got}. The device was released; "
        f"correct the input of {channel.role.value} in the hardware configuration"
    )
