"""The procedure of the first day, and the page that is its record."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from ..bench.bench import Bench
from ..bench.result import BenchReport, CheckResult, Verdict
from ..check.admission import check_bench
from ..check.bench_report import bench_report
from ..errors import CheckFailed
from ..rig import Channel, Rig, Role, calibrations, channels_of
from ..stopping.stop import StopSwitch

FIRST_VPP = 5e-3
"""The first that plays on a new bench, peak to peak [V]."""
_FROM = {
    Role.DRIVE_VOLTAGE: "T-piece at the output of the generator",
    Role.AMPLIFIER_VOLTAGE: "output of the amplifier, beside the shaker",
    Role.BASE_ACCELERATION: "accelerometer on the base",
    Role.M0_VELOCITY: "velocity output of the vibrometer",
}
Confirmed = Callable[[str], str]
"""Asks for a pair of ends to be wired; the answer stands in the page, and an empty one stops the day."""


@dataclass(frozen=True)
class DayPage:
    """The record of a first day."""

    text: str
    """Markdown."""
    verdict: Verdict
    """The worst that was found."""


def first_day(
    bench: Bench, config: Path, operator: str, confirmed: Confirmed, switch: StopSwitch | None = None
) -> DayPage:
    """Go through wires, noise floor, a first 5 mV and the bench check, which is kept as any other.

    The check at its usual level plays only when nothing at 5 mV forbids it. The end is silence.

    Raises
    ------
    CheckFailed
        When a pair of wires is not confirmed; nothing has played then.
    InstrumentError
        When an instrument fails.

    """
    folder = config.absolute().parent
    again = f"begin again with --from {in_a_command(config)} and the name of a new one"
    pages = [*_head(bench, config, operator), *_wires(bench.rig, confirmed, again)]
    first = bench_report(bench, folder, switch, FIRST_VPP)
    pages += _chapter(f"Noise floor, and the first {1e3 * FIRST_VPP:g} mVpp", first)
    if first.verdict is Verdict.FAIL:
        pages.append(f"The bench check was not played: mend what FAILs above, and {again}.")
        return DayPage("\n".join(pages) + "\n", Verdict.FAIL)
    checked = check_bench(bench, folder, switch=switch)
    pages += _chapter("The bench check, at two per cent of the amplitude limit", checked.report)
    pages += list(_next_steps(bench.rig, checked, config))
    return DayPage("\n".join(pages) + "\n", checked.verdict)


def in_a_command(path: Path) -> str:
    """Write a path as any shell takes it."""
    return f'"{path}"' if " " in str(path) else str(path)


def _head(bench: Bench, config: Path, operator: str) -> Iterator[str]:
    sheet = bench.confirmations
    yield f"# First day of {bench.rig.name}"
    now = datetime.now(UTC).astimezone()
    yield f"\n{now:%Y-%m-%d %H:%M %Z}, by {operator}. Configuration: `{config.name}`."
    yield "\n## Instruments\n"
    for part, identity in bench.identities.items():
        yield f"- {part}: {identity.reply}"
    for one in calibrations(bench.rig, datetime.now(UTC).astimezone().date()):
        yield f"- {one}{'' if one.is_valid else f': {one.advice}'}"
    yield f"\n## Confirmed by hand ({sheet.operator})\n"
    for knob in sheet.knobs:
        yield f"- {knob.instrument}, {knob.setting}: {knob.value}"


def _wires(rig: Rig, confirmed: Confirmed, again: str) -> Iterator[str]:
    yield "\n## Wires, both ends of each\n"
    for channel in channels_of(rig):
        pair = _pair(rig, channel)
        answer = confirmed(pair)
        if not answer:
            raise CheckFailed(f"not confirmed: {pair}. Nothing has played; plug it in, and {again}")
        yield f"- {pair}: {answer}"


def _pair(rig: Rig, channel: Channel) -> str:
    config = next(each for each in rig.daq.channels if each.role is channel.role)
    divider = f" over a divider of {config.attenuation:g}:1" if config.attenuation != 1 else ""
    current = f", IEPE {1e3 * config.iepe_current_a:g} mA" if config.iepe_current_a else ""
    return f"{_FROM[channel.role]}{divider} to {channel.physical} ({channel.coupling}{current})"


def _chapter(title: str, report: BenchReport) -> Iterator[str]:
    yield f"\n## {title}: {report.verdict.value}\n\n```"
    yield report.text()
    yield "```"


def _next_steps(rig: Rig, checked: CheckResult, config: Path) -> Iterator[str]:
    bench = in_a_command(config)
    if checked.verdict is Verdict.FAIL:
        yield "\nDo not energise: mend what FAILs, and check again with"
        yield f"\n    vibench bench check --bench {bench}"
        return
    yield f"\nThe bench may be armed for {rig.check_valid_h:g} h. Record a first sweep with"
    yield f"\n    vibench measure first_day --bench {bench} --out recordings"
