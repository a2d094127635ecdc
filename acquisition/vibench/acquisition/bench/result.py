"""A check of a bench as it is kept: one finding a question, when it was made, and on which configuration."""

import hashlib
import json
from dataclasses import dataclass
from datetime import datetime, timedelta
from enum import StrEnum
from typing import Self

from pydantic import AwareDatetime, Field

from ..host.toml_file import FrozenModel
from ..rig import Rig


class Verdict(StrEnum):
    """How a finding is to be taken."""

    OK = "ok"
    WARN = "warn"
    """Look at it; a measurement may be worth less."""
    FAIL = "fail"
    """Do not energise."""


_ORDER = (Verdict.OK, Verdict.WARN, Verdict.FAIL)


class Finding(FrozenModel):
    """One question to the bench and its answer."""

    name: str = Field(min_length=1)
    value: str
    """Value as text, with unit and uncertainty."""
    expected: str
    verdict: Verdict
    number: float | None = None
    """The value as a number, in ``unit``; absent where there is none."""
    uncertainty: float | None = None
    """Standard uncertainty of the number."""
    unit: str = ""
    advice: str = ""
    """What to do; empty when all is well."""


@dataclass(frozen=True)
class Bounds:
    """Up to where a deviation is well, and from where it forbids to energise."""

    well: float
    fail: float

    def verdict(self, deviation: float) -> Verdict:
        """Judge a deviation; one that is not a number fails."""
        if deviation <= self.well:
            return Verdict.OK
        return Verdict.WARN if deviation <= self.fail else Verdict.FAIL


def finding_of(
    name: str,
    number: float,
    unit: str,
    expected: str,
    verdict: Verdict,
    advice: str,
    uncertainty: float | None = None,
) -> Finding:
    """Make a finding of a number; the advice is dropped when all is well."""
    spread = "" if uncertainty is None else f" +- {uncertainty:.1g}"
    return Finding(
        name=name,
        value=f"{number:.4g}{spread} {unit}".rstrip(),
        expected=expected,
        verdict=verdict,
        number=number,
        uncertainty=uncertainty,
        unit=unit,
        advice="" if verdict is Verdict.OK else advice,
    )


class BenchReport(FrozenModel):
    """Everything that a check of the bench has found."""

    findings: tuple[Finding, ...]

    @property
    def verdict(self) -> Verdict:
        """The worst of all."""
        return max((finding.verdict for finding in self.findings), key=_ORDER.index, default=Verdict.OK)

    def __getitem__(self, name: str) -> Finding:
        """Return the finding of that name; raises KeyError with the names there are."""
        for finding in self.findings:
            if finding.name == name:
                return finding
        raise KeyError(f"{name!r}: there are {', '.join(finding.name for finding in self.findings)}")

    def text(self) -> str:
        """Lay it out as a table, with the advice under each line that needs it."""
        rows = [(f.verdict.upper(), f.name, f.value, f.expected) for f in self.findings]
        header = ("", "finding", "measured", "expected")
        widths = [max(len(row[column]) for row in (header, *rows)) for column in range(len(header))]
        lines = [_line(header, widths)]
        for row, finding in zip(rows, self.findings, strict=True):
            lines.append(_line(row, widths))
            if finding.advice:
                lines.append(f"{'':{widths[0]}}  -> {finding.advice}")
        return "\n".join(lines)


def _line(cells: tuple[str, ...], widths: list[int]) -> str:
    return "  ".join(f"{cell:{width}}" for cell, width in zip(cells, widths, strict=True)).rstrip()


_PACE = {"pace", "speed", "faults"}
"""How fast a virtual rig is played, and what is to happen to it, make it no other rig."""
_HOUR = timedelta(hours=1)
_DAY = timedelta(days=1)


class CheckResult(FrozenModel):
    """What a check of a bench has found, with all that is needed to tell whether it still holds."""

    rig: str
    """Name of the rig."""
    rig_digest: str
    """Fingerprint of the configuration that was checked: see `rig_digest`."""
    checked: AwareDatetime
    verdict: Verdict
    findings: tuple[Finding, ...]

    @classmethod
    def of(cls, rig: Rig, report: BenchReport, checked: datetime) -> Self:
        """Put a report together with its rig and its time."""
        return cls(
            rig=rig.name,
            rig_digest=rig_digest(rig),
            checked=checked,
            verdict=report.verdict,
            findings=report.findings,
        )

    @property
    def report(self) -> BenchReport:
        """What was found."""
        return BenchReport(findings=self.findings)

    def age_h(self, now: datetime) -> float:
        """Hours since."""
        return (now - self.checked) / _HOUR


def rig_digest(rig: Rig) -> str:
    """Fingerprint of everything that a configuration says of a bench; 64 hexadecimal digits."""
    content = rig.model_dump(mode="json", exclude={"check_valid_h": True, "virtual": _PACE})
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def ago(age: timedelta) -> str:
    """Say an age as people do: ``"3 hours"``, ``"2 days"``."""
    if age < 2 * _HOUR:
        return f"{max(age.total_seconds(), 0.0) / 60:.0f} minutes"
    return f"{age / _HOUR:.0f} hours" if age < 2 * _DAY else f"{age / _DAY:.0f} days"
