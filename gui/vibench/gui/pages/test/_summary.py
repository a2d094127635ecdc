"""The live arithmetic of a test: what it comes to, in one line."""

from vibench.acquisition.plan import LimitCheck, Outlook

from ...widgets import clock

_SHOWN = ("the stroke", "the table's acceleration", "the force", "the amplifier's voltage")
_UNITS = {"m": ("mm", 1e3), "m/s2": ("m/s²", 1.0), "N": ("N", 1.0), "V": ("V", 1.0)}


def summary_text(seen: Outlook) -> str:
    """Peak stroke, acceleration, force and volts beside their limits; then time and size."""
    parts = [_load(check) for name in _SHOWN for check in seen.checks if check.what.startswith(name)]
    parts.append(f"generator {seen.peak_v:.3g} V peak, crest {seen.crest_factor:.2f}")
    parts.append(f"takes {clock(seen.duration_s)}")
    parts.append(f"file {seen.size_bytes / 1e6:.0f} MB")
    passed = [check for check in seen.checks if not check.is_kept]
    broken = sorted(passed, key=lambda check: not check.forbids)
    said = "   ·   ".join(parts)
    if not broken:
        return f"✔ within all limits   ·   {said}"
    sign = "✖" if broken[0].forbids else "⚠"
    return f"{sign} {broken[0].complaint()}   ·   {said}"


def _load(check: LimitCheck) -> str:
    unit, factor = _UNITS.get(check.unit, (check.unit, 1.0))
    name = check.what.partition(" (")[0].removeprefix("the ").removeprefix("table's ")
    return f"{name} {check.value * factor:.3g} of {check.limit * factor:.3g} {unit}"
