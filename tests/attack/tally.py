"""Mutants by number, in shards whose results are added up.

Mutant ``n`` of a seed is the same in every shard and on every computer, so that a finding is named by two
numbers and can be made again.
"""

import json
import random
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from math import inf
from pathlib import Path
from typing import Any, Self


@dataclass(frozen=True)
class Shard:
    """Which mutants of a seed are tried here: every ``of``-th of the first ``count``, from ``part`` on."""

    seed: int
    count: int
    part: int = 0
    of: int = 1
    until_s: float = inf
    """No further mutant is begun after this time of `time.monotonic`."""

    @property
    def numbers(self) -> range:
        """Numbers of the mutants of this shard."""
        return range(self.part, self.count, self.of)

    def chances(self) -> Iterator[tuple[int, random.Random]]:
        """Give each number with the source of chance that its mutant is made from."""
        for number in self.numbers:
            if time.monotonic() > self.until_s:
                return
            yield number, random.Random(f"{self.seed}:{number}")


@dataclass(frozen=True)
class Finding:
    """A mutant that did what none may do."""

    target: str
    seed: int
    number: int
    faults: tuple[str, ...]
    told: str
    """The end of what it said."""


@dataclass
class Tally:
    """What was tried, how it ended, and what was found."""

    target: str
    tried: int = 0
    codes: dict[str, int] = field(default_factory=dict)
    """How often each ending was seen: an exit code, or the kind of an answer."""
    worst_s: float = 0.0
    worst_bytes: int = 0
    findings: list[Finding] = field(default_factory=list)

    def count(self, ending: object, took_s: float = 0.0, peak_bytes: int = 0) -> None:
        """Add one that was tried."""
        self.tried += 1
        self.codes[str(ending)] = self.codes.get(str(ending), 0) + 1
        self.worst_s = max(self.worst_s, took_s)
        self.worst_bytes = max(self.worst_bytes, peak_bytes)

    def add(self, other: Self) -> None:
        """Add what another shard of the same target has seen."""
        if other.target != self.target:
            raise ValueError(f"{other.target} and {self.target} are different targets")
        self.tried += other.tried
        for code, count in other.codes.items():
            self.codes[code] = self.codes.get(code, 0) + count
        self.worst_s = max(self.worst_s, other.worst_s)
        self.worst_bytes = max(self.worst_bytes, other.worst_bytes)
        self.findings += other.findings

    def line(self) -> str:
        """Say it in one line."""
        codes = ", ".join(f"{code}: {count}" for code, count in sorted(self.codes.items()))
        return (
            f"{self.target}: {self.tried} tried ({codes}), {len(self.findings)} found; "
            f"longest {self.worst_s:.1f} s, most memory {self.worst_bytes / 1e6:.0f} MB"
        )


def save(tallies: Sequence[Tally], path: Path) -> None:
    """Write what a shard has seen of each target, for `saved_tallies`."""
    path.write_text(json.dumps([asdict(tally) for tally in tallies], indent=1), encoding="utf-8")


def saved_tallies(path: Path) -> list[Tally]:
    """Read what a shard has written."""
    return [_tally(content) for content in json.loads(path.read_text(encoding="utf-8"))]


def _tally(content: dict[str, Any]) -> Tally:
    findings = [Finding(**{**each, "faults": tuple(each["faults"])}) for each in content.pop("findings")]
    return Tally(**content, findings=findings)


Attack = Callable[[Shard], Tally]
"""Tries the mutants of a shard."""
