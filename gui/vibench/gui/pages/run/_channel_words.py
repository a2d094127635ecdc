"""Channels as people call them, and the units that suit them."""

from ...plots import Axis

_WORDS = {
    "drive_voltage": "drive",
    "amplifier_voltage": "amplifier",
    "base_acceleration": "base",
    "m0_velocity": "m0",
}
_SHORT = {"amplifier_voltage": "amp."}
_UNITS = {"V": ("V", 1.0), "m s-2": ("m/s²", 1.0), "m s-1": ("mm/s", 1e3)}


def channel_word(role: str) -> str:
    """Say a channel in a word."""
    return _WORDS.get(role, role.replace("_", " "))


def channel_axis(role: str, unit: str) -> Axis:
    """Give a channel's axis: its word, in a unit whose numbers are easy to read."""
    shown, factor = _UNITS.get(unit, (unit, 1.0))
    return Axis(channel_word(role), shown, factor, short=f"{_SHORT.get(role, channel_word(role))} ({shown})")
