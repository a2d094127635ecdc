"""Times of day and dates in text, as seconds.

The order of day, month and year is found from consecutive rows: the right order makes them closest in time.
Times without a date continue to increase past midnight.
"""

import re
from collections.abc import Iterator
from contextlib import suppress
from datetime import date

_NAMES = (
    "jan feb mar apr may jun jul aug sep oct nov dec jan feb m\u00e4r apr mai jun jul aug sep okt nov dez"
)
_MONTHS = {name: 1 + place % 12 for place, name in enumerate(_NAMES.split())}
_DATE = r"(?P<date>\d{1,4}(?P<sign>[-/.])(?:\d\d?|[A-Za-z\u00e4]{3,9})(?P=sign)\d{2,4})"
_TIME = (
    r"(?:(?P<hour>\d{1,3}):)?(?P<minute>\d\d?):(?P<second>\d\d)(?P<part>[.,]\d+|:\d{3})?"
    r"(?: ?(?P<half>[AaPp])\.?[Mm]\.?)?(?:Z|[+-]\d\d:?\d\d)?"
)
_ALONE = _TIME.replace("?P<", "?P<only_")
_CLOCK = re.compile(rf"(?<![\w:.,/-])(?:{_DATE}(?:[T ]{_TIME})?|{_ALONE})(?![\w:/-])")
"""A date, a time of day, or both: ``2026-03-01T12:00:00.0002``, ``03/01/2026 11:59:58.5 PM``."""
_HOUR_S, _DAY_S = 3600, 86400


class ClockTimes:
    """Converter of the dates and times of a file, read in order, to seconds since its first midnight."""

    def __init__(self) -> None:
        self._last_s: float | None = None
        self._day = 0
        self._date = ""

    def in_seconds(self, text: str) -> str:
        """Replace times in a text by seconds, and dates without a time by days."""
        return _CLOCK.sub(self._number, text)

    def _number(self, found: re.Match[str]) -> str:
        hour, minute, second, part, half = (
            found[name] or found[f"only_{name}"] for name in ("hour", "minute", "second", "part", "half")
        )
        is_known = not found["date"] or self._turns_to(found["date"])
        if not is_known or (minute and not hour and not part):
            return found[0]  # two numbers may be hours and minutes, or minutes and seconds
        if minute is None:
            return str(self._day)
        hours = int(hour or 0) if half is None else int(hour or 0) % 12 + 12 * (half in "Pp")
        clock_s = 60.0 * (60 * hours + int(minute)) + float(f"{second}.{(part or '.')[1:] or 0}")
        turn_s = _DAY_S if hour else _HOUR_S
        if self._date:
            clock_s += self._day * _DAY_S
        elif self._last_s is not None:
            clock_s += turn_s * round((self._last_s - clock_s) / turn_s)
        self._last_s = clock_s
        return f"{clock_s:.9f}"

    def _turns_to(self, text: str) -> bool:
        """Advance to a date, in the order of parts nearest to the last date; return whether it is valid."""
        if text == self._date:
            return True
        pairs = zip(_orders(self._date or text), _orders(text), strict=True)
        days = [(after - before).days for before, after in pairs if before and after]
        self._day += min(days, key=abs, default=0)
        self._date = text
        return bool(days)


def _orders(text: str) -> Iterator[date | None]:
    """Yield the date as read with the year, the day or the month first; None if invalid."""
    parts = [
        int(each) if each.isdecimal() else _MONTHS.get(each[:3].casefold(), 0)
        for each in re.split("[-/.]", text)
    ]
    for order in ((0, 1, 2), (2, 1, 0), (2, 0, 1)):
        year, month, day = (parts[place] for place in order)
        found = None
        with suppress(ValueError):
            found = date(year if year > 99 else 2000 + year, month, day)
        yield found
