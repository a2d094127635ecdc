"""What a check found, as people read it: prefixes in place of powers of ten."""

from math import floor, isfinite, log10

from vibench.acquisition import Finding

_PREFIXED = frozenset({"V", "A", "s", "m", "Hz", "W"})
_PREFIXES = {-9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M"}
_PLAIN_FROM, _PLAIN_TO = 0.01, 1e5


def finding_name(finding: Finding) -> str:
    """``"noise of drive voltage"``."""
    return finding.name.replace("_", " ")


def measured_text(finding: Finding) -> str:
    """``"20 µV"`` for 1.997e-05 V; everything else as the check says it."""
    number = finding.number
    if number is None or finding.unit not in _PREFIXED or not isfinite(number) or number == 0.0:
        return finding.value
    if _PLAIN_FROM <= abs(number) < _PLAIN_TO:
        return finding.value
    power = min(max(3 * floor(log10(abs(number)) / 3), min(_PREFIXES)), max(_PREFIXES))
    unit = f"{_PREFIXES[power]}{finding.unit}"
    scale = 10.0**-power
    spread = "" if finding.uncertainty is None else f" ± {finding.uncertainty * scale:.1g}"
    return f"{number * scale:.3g}{spread} {unit}"


def expected_text(finding: Finding) -> str:
    """Say what was expected, and what to do where it was not found."""
    advice = finding.advice
    return f"{finding.expected}. {advice[0].upper()}{advice[1:]}" if advice else finding.expected
