"""A check of a bench as it is kept: what was found, when, and on which configuration."""

import hashlib
import json
from datetime import datetime, timedelta
from typing import Self

from pydantic import AwareDatetime

from ..host import FrozenModel
from ..rig import Rig
from ._finding import BenchReport, Finding, Verdict

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
