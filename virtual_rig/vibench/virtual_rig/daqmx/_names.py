"""Lists and ranges of channel names, as DAQmx programs write them: ``"Dev1/ai0:3, cDAQ1Mod1/ai2"``."""

import re
from collections.abc import Iterable

_RANGE = re.compile(r"^(?P<stem>.*?)(?P<first>\d+):(?P<stem_again>.*?)(?P<last>\d+)$")


def expand(text: str) -> tuple[str, ...]:
    """Every single name in a list of names and ranges, in the order given.

    ``"Dev1/ai0:2"`` and ``"Dev1/ai0:Dev1/ai2"`` both give three names; ``"ai2:0"`` counts down.
    """
    names: list[str] = []
    for part in text.split(","):
        names.extend(_expand_one(part.strip()))
    return tuple(names)


def _expand_one(part: str) -> Iterable[str]:
    if not part:
        return ()
    found = _RANGE.match(part)
    if found is None or found["stem_again"] not in ("", found["stem"], found["stem"].rpartition("/")[2]):
        return (part,)
    first, last = int(found["first"]), int(found["last"])
    step = 1 if last >= first else -1
    return (f"{found['stem']}{number}" for number in range(first, last + step, step))


def join(names: Iterable[str]) -> str:
    """One list of names, as a string attribute carries it."""
    return ", ".join(names)


def assigned_names(given: str, physical: tuple[str, ...]) -> tuple[str, ...]:
    """Names of the virtual channels: the physical names, or what the caller gave, numbered if they are many.

    A list or range with as many names as there are channels is used as it is.
    """
    if not given:
        return physical
    names = expand(given)
    if len(names) == len(physical):
        return names
    return tuple(f"{given}{number}" for number in range(len(physical)))
