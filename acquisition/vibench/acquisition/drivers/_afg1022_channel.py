"""One channel of an AFG1022 as it was last read back: settings, declared load, memory and output relay."""

from dataclasses import dataclass, replace

import numpy as np

from ..errors import InstrumentError, SettingRefused
from ..instruments import Knob
from ..rig import HIGH_Z
from ._afg1022_modes import arm_burst, end_burst, switch_off_modes
from ._arbitrary_codes import ArbitraryCodes
from ._generator_limits import Load, Shape
from ._scpi import ScpiPort, number_in
from ._verified_settings import Tolerance, VerifiedSettings

# Frequencies are sent to 1 uHz; seven digits are the least that a reply has been seen to carry.
_FREQUENCY = Tolerance(absolute=1.5e-6, relative=1e-6)
# The panel resolves 1 mVpp; more than that, or 0.1 %, is another value.
_AMPLITUDE = Tolerance(absolute=0.6e-3, relative=1e-3)
_OFF = frozenset({"0", "OFF"})
_ON = frozenset({"1", "ON"})
_SHAPE_ANSWERS = {
    Shape.SINE: frozenset({"SIN", "SINUSOID"}),
    Shape.EDIT_MEMORY: frozenset({"EMEM", "EMEMORY"}),
}
_QUIET_FREQUENCY_HZ = 1000.0


@dataclass(frozen=True)
class Playing:
    """What a channel holds, as read back from it."""

    shape: Shape
    frequency_hz: float
    panel_vpp: float
    offset_v: float
    codes: ArbitraryCodes | None = None

    @property
    def panel_factor(self) -> float:
        """Panel amplitude per amplitude that was asked for; other than 1 only for an uneven waveform."""
        return 1.0 if self.codes is None else self.codes.panel_factor


class Afg1022Channel:
    """Single steps on one channel, each verified; what a sequence of steps is safe, its owner decides."""

    def __init__(self, settings: VerifiedSettings, channel: int, minimum_vpp: float) -> None:
        self.settings = settings
        self._channel = channel
        self._minimum_vpp = minimum_vpp
        self._playing: Playing | None = None

    @property
    def playing(self) -> Playing:
        """What the channel holds."""
        if self._playing is None:
            raise InstrumentError(
                f"{self.settings.name} has no known settings since a change failed; "
                "load a sine or a waveform first"
            )
        return self._playing

    @property
    def is_known(self) -> bool:
        """Whether its settings have been read back since the last failure."""
        return self._playing is not None

    def forget(self) -> None:
        """Hold nothing for known any more: a change was broken off."""
        self._playing = None

    def output_on(self) -> None:
        """Close the output relay, and see that it is closed."""
        _ = self.playing  # with unknown settings it stays off
        self.settings.set_word(f"OUTP{self._channel}:STAT", "ON", _ON)

    def output_off(self) -> None:
        """Open the output relay, and see that it is open."""
        # Complaints, old ones above all, must not keep the output on: what it reads back decides.
        self.settings.port.send(f"OUTP{self._channel}:STAT OFF")
        self.settings.expect_word(f"OUTP{self._channel}:STAT", "OFF", _OFF)

    def to_quiet_sine(self) -> None:
        """Whatever it was: no modes, no offset, the smallest amplitude, a sine."""
        # *RST is not used: what it does to the output of this model is not documented.
        self.switch_off_modes()
        self._playing = Playing(Shape.SINE, _QUIET_FREQUENCY_HZ, self._minimum_vpp, 0.0)
        self.set_offset(0.0)  # first: it lowers the peak whatever the amplitude is
        self.mute()
        self.select_sine()
        self.set_frequency(_QUIET_FREQUENCY_HZ)

    def switch_off_modes(self) -> None:
        """End sweep, burst, modulation and frequency lock."""
        switch_off_modes(self.settings, self._channel)

    def mute(self) -> None:
        """Set the smallest amplitude."""
        self.set_panel(self._minimum_vpp)

    def set_frequency(self, frequency_hz: float) -> None:
        """Set the frequency of the sine, or how often a second the memory is played."""
        header = f"SOUR{self._channel}:FREQ"
        got_hz = self.settings.set_number(header, frequency_hz, f"{frequency_hz:.6f}", _FREQUENCY)
        self._playing = replace(self.playing, frequency_hz=got_hz)

    def set_panel(self, panel_vpp: float) -> None:
        """Set the amplitude that the panel shows, peak to peak [V]."""
        header = f"SOUR{self._channel}:VOLT"
        got_vpp = self.settings.set_number(header, panel_vpp, f"{panel_vpp:.4f}VPP", _AMPLITUDE)
        self._playing = replace(self.playing, panel_vpp=got_vpp)

    def set_offset(self, offset_v: float) -> None:
        """Set the offset [V]."""
        header = f"SOUR{self._channel}:VOLT:OFFS"
        got_v = self.settings.set_number(header, offset_v, f"{offset_v:.4f}", _AMPLITUDE)
        self._playing = replace(self.playing, offset_v=got_v)

    def select_sine(self) -> None:
        """Play a sine."""
        self._select(Shape.SINE, None)

    def select_memory(self, codes: ArbitraryCodes) -> None:
        """Play the edit memory, which holds ``codes``."""
        self._select(Shape.EDIT_MEMORY, codes)

    def upload(self, codes: ArbitraryCodes) -> None:
        """Fill the edit memory, and compare it point by point."""
        points = codes.codes.size
        self.settings.port.command(f"DATA:DEF EMEM,{points}")
        self.settings.port.write_codes("DATA:DATA EMEM,", codes.codes)
        held = self.settings.port.query_codes("DATA:DATA? EMEM")
        if not np.array_equal(held, codes.codes):
            compared = min(points, held.size)
            same = int(np.count_nonzero(held[:compared] == codes.codes[:compared]))
            raise SettingRefused(
                f"{self.settings.name}: {points} points were put in its memory, and {held.size} read back, "
                f"of which {same} agree. Upload again; if it fails again, check the USB cable"
            )

    def arm_burst(self, cycles: int) -> None:
        """Play ``cycles`` periods at each trigger instead of playing on."""
        arm_burst(self.settings, self._channel, cycles)

    def end_burst(self) -> None:
        """Play on without a trigger."""
        end_burst(self.settings, self._channel)

    def agree_on_load(self, load: Load) -> tuple[Knob, ...]:
        """Make the generator expect ``load``; return what the operator must confirm."""
        return agree_on_load(self.settings.port, f"OUTP{self._channel}:IMP", load)

    def _select(self, shape: Shape, codes: ArbitraryCodes | None) -> None:
        self.settings.set_word(f"SOUR{self._channel}:FUNC:SHAP", shape.value, _SHAPE_ANSWERS[shape])
        self._playing = replace(self.playing, shape=shape, codes=codes)


# High impedance is answered 9.9E+37; anything beyond the largest finite load (10 kohm) means it.
_INFINITE_OHM = 1e6
_SAME_LOAD = 0.01


def agree_on_load(port: ScpiPort, header: str, load: Load) -> tuple[Knob, ...]:
    """Make the generator expect ``load``; return what the operator must confirm when it cannot be known.

    Sources contradict each other on whether an AFG1022 takes its load remotely (hardware reference
    1.2), so it is tried. A wrong load is a factor of two at the terminal.

    Raises
    ------
    SettingRefused
        When the generator says that it expects another load, and does not let it be changed.

    """
    wanted = "INF" if load == HIGH_Z else f"{load:g}"
    try:
        port.command(f"{header} {wanted}")
    except SettingRefused:
        raise
    except InstrumentError as refusal:
        return _read_only(port, header, load, refusal)
    return _read_only(port, header, load, None)


def _read_only(port: ScpiPort, header: str, load: Load, refusal: InstrumentError | None) -> tuple[Knob, ...]:
    reply = port.query(f"{header}?")
    port.complaints()  # an unknown query leaves one; the empty answer has already said so
    if not reply:
        return (Knob(instrument="generator", setting="output load", value=_panel_text(load)),)
    held_ohm = number_in(reply, f"{header}?")
    if _same(held_ohm, load):
        return ()
    raise SettingRefused(
        f"the generator expects a load of {_ohm_text(held_ohm)} where generator.load_ohm says {load}: every "
        "amplitude would be wrong, by a factor of two between 50 ohm and high-Z. The output is off; set "
        f"the load to {_panel_text(load)} on its panel, or correct the configuration"
    ) from refusal


def _same(held_ohm: float, load: Load) -> bool:
    if isinstance(load, str):
        return held_ohm > _INFINITE_OHM
    return abs(held_ohm - load) <= _SAME_LOAD * load


def _ohm_text(ohm: float) -> str:
    return HIGH_Z if ohm > _INFINITE_OHM else f"{ohm:g} ohm"


def _panel_text(load: Load) -> str:
    return load if isinstance(load, str) else f"{load:g} ohm"
