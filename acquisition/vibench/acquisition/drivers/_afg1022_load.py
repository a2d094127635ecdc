"""Which load the generator believes to see: set it, ask for it, or leave it to the operator."""

from ..errors import InstrumentError, SettingRefused
from ..rig import HIGH_Z, Knob
from ._afg1022_limits import Load
from ._scpi import ScpiPort, number_in

# High impedance is answered 9.9E+37; anything beyond the largest finite load (10 kohm) means it.
_INFINITE_OHM = 1e6
_SAME_LOAD = 0.01


def agree_on_load(port: ScpiPort, channel: int, load: Load) -> tuple[Knob, ...]:
    """Make the generator expect ``load``; return what the operator must confirm when it cannot be known.

    Sources contradict each other on whether an AFG1022 takes its load remotely (hardware reference
    1.2), so it is tried. A wrong load is a factor of two at the terminal.

    Raises
    ------
    SettingRefused
        When the generator says that it expects another load, and does not let it be changed.

    """
    header = f"OUTP{channel}:IMP"
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
