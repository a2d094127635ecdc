"""The bench on which a campaign was started: configuration, instruments and manual settings."""

from collections.abc import Iterator, Mapping
from typing import Any, Self

from ..bench.bench import Bench
from ..host.toml_file import FrozenModel
from ..rig import Rig


class Instrument(FrozenModel):
    """Identity reported by an instrument."""

    maker: str
    model: str
    serial: str
    firmware: str


class BenchIdentity(FrozenModel):
    """Properties of a bench that must not change during a campaign unless the change is confirmed."""

    rig: Rig
    instruments: dict[str, Instrument]
    knobs: dict[str, str]
    """Confirmed manual settings (knobs), without time of confirmation and name of the operator."""

    @classmethod
    def of(cls, bench: Bench) -> Self:
        """Return configuration, instruments and manual settings of an open bench."""
        instruments = {
            part: Instrument(maker=each.maker, model=each.model, serial=each.serial, firmware=each.firmware)
            for part, each in bench.identities.items()
        }
        knobs = {f"{knob.instrument} {knob.setting}": knob.value for knob in bench.confirmations.knobs}
        return cls(rig=bench.rig, instruments=instruments, knobs=knobs)

    def differences(self, now: "BenchIdentity") -> tuple[str, ...]:
        """Return one clause of text for each difference between this bench and a later one, ``now``."""
        return differences(self.model_dump(mode="json"), now.model_dump(mode="json"))


def differences(before: Mapping[str, Any], now: Mapping[str, Any]) -> tuple[str, ...]:
    """Return one clause of text for each difference between two nested descriptions."""
    return tuple(_differences("", before, now))


def _differences(place: str, before: Any, now: Any) -> Iterator[str]:
    match before, now:
        case Mapping(), Mapping():
            for key in dict.fromkeys((*before, *now)):
                yield from _differences(
                    f"{place}.{key}".removeprefix("."), before.get(key, _ABSENT), now.get(key, _ABSENT)
                )
        case list(), list() if len(before) == len(now):
            for number, (one, other) in enumerate(zip(before, now, strict=True)):
                yield from _differences(f"{place}.{number}", one, other)
        case _ if before != now:
            yield f"{place} was {before!r} and is now {now!r}"


class _Absent:
    def __repr__(self) -> str:
        return "absent"


_ABSENT = _Absent()
