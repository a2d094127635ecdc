"""Lists and ranges of channel names, as DAQmx programs write them: ``"Dev1/ai0:3, cDAQ1Mod1/ai2"``."""

import re
from collections.abc import Iterable

_RANGE = re.compile(r"^(?P<stem>.*?)(?P<first>\d+):(?P<stem_again>.*?)(?P<last>\d+)$")


def expand(text: str) -> tuple[str, ...]:
    """Return every single name in a list of names and ranges, in the order given.

    ``"Dev1/ai0:2"`` and ``"Dev1/ai0:Dev1/ai2"`` both give three names; ``"ai2:0"`` counts down.
    """
    return tuple(name for part in text.split(",") for name in _expand_one(part.strip()))


def _expand_one(part: str) -> Iterable[str]:
    if not part:
        return ()
    found = _RANGE.match(part)
    if found is None or found["stem_again"] not in ("", found["stem"], found["stem"].rpartition("/")[2]):
        return (part,)
    first, last = int(found["first"]), int(found["last"])
    step = 1 if last >= first else -1
    return (f"{found['stem']}{number}" for number in range(first, last + step, step))


def assigned_names(given: str, physical: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names of virtual channels: the physical ones, or what was given, numbered if they are many.

    A list or range with as many names as there are channels is used as it is.
    """
    if not given:
        return physical
    names = expand(given)
    if len(names) == len(physical):
        return names
    return tuple(f"{given}{number}" for number in range(len(physical)))
