"""Base level and responses of a recording, and a comparison of its specimen with a simulated one."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass

from vibench.sim import Specimen

from ..comparison.curve import Curve
from ._map_words import value_words


@dataclass(frozen=True, eq=False)
class RecordedLevel:
    """Measured base amplitude and Response I of a recording over frequency."""

    name: str
    pairs: Sequence[tuple[float, float]]
    """Frequency [Hz] and base amplitude [m]."""
    measured: Sequence[Curve]
    """Curves of Response I of m0."""
    specimen: Specimen | None = None
    """Specimen stored in the recording; None if the recording describes none."""

    def difference(self, simulated: Specimen) -> str:
        """Return `specimen_difference` from the recorded specimen."""
        return specimen_difference(simulated, self.specimen, self.name)


def specimen_difference(simulated: Specimen, recorded: Specimen | None, name: str) -> str:
    """Return a sentence on how a simulated specimen differs from the recorded one; empty if they are equal.

    Parameters
    ----------
    name
        Name of the recording.
    """
    if recorded is None:
        return f"{name} describes no specimen, so the simulated specimen could not be compared with it."
    pairs = zip(_properties(simulated), _properties(recorded), strict=True)
    changed = "; ".join(f"{ours} instead of {theirs}" for ours, theirs in pairs if ours != theirs)
    return f"The simulated specimen is not the one described in {name}: {changed}." if changed else ""


def _properties(specimen: Specimen) -> tuple[str, ...]:
    """Return the properties of a specimen in words, always in the same order."""
    law = ", ".join(f"{name} {value_words(value)}" for name, value in asdict(specimen.contact).items())
    return (
        f"masses {value_words(specimen.masses)} kg",
        f"stiffnesses {value_words(specimen.stiffnesses)} N/m",
        f"dampings {value_words(specimen.dampings)} N s/m",
        f"gaps {value_words(specimen.gaps_m)} m",
        f"contact {law}",
    )
