"""Numbered mutants in shards; results are saved after each mutant and can be added up.

Mutant ``n`` of a seed is the same in every shard and on every computer, so that two numbers identify a
finding and reproduce it.
"""

import json
import random
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field
from math import inf
from pathlib import Path
from typing import Any, Self


@dataclass(frozen=True)
class Finding:
    """A mutant that violated a limit."""

    target: str
    seed: int
    number: int
    faults: tuple[str, ...]
    told: str
    """End of the output of the command or server."""


@dataclass
class Tally:
    """Number of tried mutants, their endings, and findings."""

    target: str
    tried: int = 0
    codes: dict[str, int] = field(default_factory=dict)
    """Number of mutants per ending: an exit code, or the kind of an answer."""
    worst_s: float = 0.0
    worst_bytes: int = 0
    findings: list[Finding] = field(default_factory=list)
    done: int = 0
    """Number of mutants of the shard that were tried; a mutant may count several times."""
    shard: str = ""

    def count(self, ending: object, took_s: float = 0.0, peak_bytes: int = 0) -> None:
        """Count one tried mutant."""
        self.tried += 1
        self.codes[str(ending)] = self.codes.get(str(ending), 0) + 1
        self.worst_s = max(self.worst_s, took_s)
        self.worst_bytes = max(self.worst_bytes, peak_bytes)

    def add(self, other: Self) -> None:
        """Add the results of another shard of the same target."""
        if other.target != self.target:
            raise ValueError(f"{other.target} and {self.target} are different targets")
        self.tried += other.tried
        for code, count in other.codes.items():
            self.codes[code] = self.codes.get(code, 0) + count
        self.worst_s = max(self.worst_s, other.worst_s)
        self.worst_bytes = max(self.worst_bytes, other.worst_bytes)
        self.findings += other.findings
        self.done += other.done

    def line(self) -> str:
        """Return the tally as one line of text."""
        codes = ", ".join(f"{code}: {count}" for code, count in sorted(self.codes.items()))
        return (
            f"{self.target}: {self.tried} tried ({codes}), {len(self.findings)} found; "
            f"longest {self.worst_s:.1f} s, most memory {self.worst_bytes / 1e6:.0f} MB"
        )


@dataclass(frozen=True)
class Shard:
    """The mutants of a seed in this shard: every ``of``-th of ``count``, beginning with ``part``."""

    seed: int
    count: int
    part: int = 0
    of: int = 1
    until_s: float = inf
    """Value of `time.monotonic` after which no further mutant is begun."""
    saved: Path | None = None
    """File with the tallies of this shard after each mutant; saved mutants are not tried again."""

    @property
    def numbers(self) -> range:
        """Numbers of the mutants of this shard."""
        return range(self.part, self.count, self.of)

    def tally(self, target: str) -> Tally:
        """Return the saved tally of a target, or a new tally.

        Raises ValueError if the file belongs to another seed or shard.
        """
        mine = f"{self.part + 1}/{self.of} of seed {self.seed}"
        kept = () if self.saved is None or not self.saved.exists() else read_tallies(self.saved)
        found = next((each for each in kept if each.target == target), Tally(target, shard=mine))
        if found.shard != mine:
            raise ValueError(f"{self.saved} holds shard {found.shard}, not {mine}; give another file")
        return found

    def chances(self, tally: Tally) -> Iterator[tuple[int, random.Random]]:
        """Yield each number that is not in the tally, with the random generator of its mutant."""
        for number in self.numbers[tally.done :]:
            if time.monotonic() > self.until_s:
                return
            yield number, random.Random(f"{self.seed}:{number}")
            tally.done += 1
            if self.saved is not None:
                save(tally, self.saved)


def save(tally: Tally, path: Path) -> None:
    """Save the results of a shard for a target; the file is replaced as a whole."""
    kept = read_tallies(path) if path.exists() else []
    tallies = [*(each for each in kept if each.target != tally.target), tally]
    unfinished = path.with_suffix(".tmp")
    unfinished.write_text(json.dumps([asdict(each) for each in tallies], indent=1), encoding="utf-8")
    unfinished.replace(path)


def read_tallies(path: Path) -> list[Tally]:
    """Read the saved results of a shard."""
    return [_tally(content) for content in json.loads(path.read_text(encoding="utf-8"))]


def _tally(content: dict[str, Any]) -> Tally:
    findings = [Finding(**{**each, "faults": tuple(each["faults"])}) for each in content.pop("findings")]
    return Tally(**content, findings=findings)


Attack = Callable[[Shard], Tally]
"""A function that tries the mutants of a shard."""
