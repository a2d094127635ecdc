"""The report of a campaign, or of one recording, as one self-contained HTML file."""

import base64
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from enum import StrEnum
from importlib.metadata import version
from itertools import islice
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from vibench.acquisition import printable
from vibench.sim.operating_system.this import replace_file

from ..errors import NotEnoughData
from ..kinds import AnyResult, DwellResult, NoiseResult
from ..recordings.checks import Verdict
from ..recordings.facts import RecordingFacts
from ..results.campaign_results import AnalysisFailure, CampaignResults, FailedStep
from ._drawings import (
    DRAWINGS,
    ReportTable,
    figures_together,
    limits,
    nearest_resonance,
    recording_figures,
    result_sentence,
    uncertainty_table,
)
from ._style import DrawnFigure

if TYPE_CHECKING:
    from vibench.sim.maps import MapResults

    from ..dynamics import BranchDiagram
    from ..hidden_motion import HiddenMotion

Rows = tuple[tuple[str, str], ...]
LONGEST_CAPTION = 225
"""Maximum number of characters of title and caption together: three lines of a figure's column."""
MOST_OPEN_CARDS = 12
"""Maximum number of cards shown unfolded, which keeps the page short."""
_LARGEST_SVG_BYTES = 300_000
"""Largest embedded SVG; above this size, a PNG is smaller, faster to show and equally legible."""
_SENTENCE_ENDS = re.compile(r"(?<=\.)(?<!\bal\.)(?<!\bFig\.)\s+(?=[A-Z0-9])")


class Agreement(StrEnum):
    """Whether a simulation, or a claim, agrees with the measurement."""

    YES = "yes"
    NO = "no"
    OPEN = "cannot tell"


@dataclass(frozen=True)
class Fold:
    """Folded part of a page: sentences, tables and figures below a heading."""

    title: str
    sentences: tuple[str, ...] = ()
    tables: tuple[ReportTable, ...] = ()
    figures: tuple[DrawnFigure, ...] = ()


@dataclass(frozen=True)
class Card:
    """Card of one recording or of one group of claims, and its row in the overview table."""

    name: str
    result: str
    """Result of the recording or of the group of claims in one sentence."""
    agreement: Agreement
    look_at: str
    """Warnings to read before the result is used."""
    numbers: Rows = ()
    """Up to three quantities: name, and value with bounds."""
    warnings: tuple[str, ...] = ()
    figure: DrawnFigure | None = None
    folds: tuple[Fold, ...] = ()


@dataclass(frozen=True)
class Page:
    """Content of a report, in the order of its fields."""

    title: str
    about: str
    """Subject of the report, shown next to date and version."""
    warnings: tuple[str, ...]
    """Warnings that change a conclusion."""
    findings: str
    """Summary of at most 120 words."""
    figure: DrawnFigure | None
    noun: str
    """Noun for the rows of the overview table, such as recording or claims."""
    cards: tuple[Card, ...]
    further: Fold
    """Unfolded part: common figures of several recordings, and sentences on the model."""
    folds: tuple[Fold, ...]
    limits: tuple[str, ...]


@dataclass(frozen=True)
class _EmbeddedFigure:
    number: int
    source: str
    """A ``data:`` address that contains the whole image."""
    caption: str
    rest: str
    """Further sentences of the caption, which are folded."""


def write_page(page: Page, path: Path, figures_folder: Path | None = None) -> Path:
    """Write one HTML file with all figures inside; an older file of that name is replaced.

    Parameters
    ----------
    figures_folder
        Folder for PNG, SVG and CSV of each figure; nothing is saved if None.
    """
    figures = list(dict.fromkeys(_figures(page)))
    environment = Environment(
        loader=PackageLoader("vibench.analysis.report", "."),
        autoescape=True,
        # Escape control characters in names and texts; Markup from the template stays unchanged.
        finalize=lambda content: printable(content) if type(content) is str else content,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    text = environment.get_template("report.html.j2").render(
        page=page,
        embedded={each: _embed(number, each, figures_folder) for number, each in enumerate(figures, 1)},
        is_long=len(page.cards) > MOST_OPEN_CARDS,
        written=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        version=version("vibench"),
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    with replace_file(path) as coming:
        coming.write_text(text, encoding="utf-8")
    return path


def _figures(page: Page) -> Iterator[DrawnFigure]:
    """Yield all figures in the order of their numbers: unfolded figures first, then figures in folds."""
    yield from (each for each in (page.figure, *(card.figure for card in page.cards)) if each is not None)
    yield from page.further.figures
    for fold in (*(fold for card in page.cards for fold in card.folds), *page.folds):
        yield from fold.figures


def _embed(number: int, drawn: DrawnFigure, folder: Path | None) -> _EmbeddedFigure:
    if folder is not None:
        drawn.save(folder)
    svg = drawn.svg
    kind, content = ("svg+xml", svg) if len(svg) <= _LARGEST_SVG_BYTES else ("png", drawn.png)
    source = f"data:image/{kind};base64,{base64.b64encode(content).decode('ascii')}"
    return _EmbeddedFigure(number, source, *split_caption(drawn))


def split_caption(drawn: DrawnFigure) -> tuple[str, str]:
    """Split a caption into its first sentences, which fill at most three lines, and the rest."""
    sentences = _SENTENCE_ENDS.split(drawn.caption)
    lengths = [len(drawn.title) + len(" ".join(sentences[:end])) for end in range(len(sentences) + 1)]
    fitting = sum(each <= LONGEST_CAPTION for each in lengths) - 1
    return " ".join(sentences[:fitting]), " ".join(sentences[fitting:])


MOST_WORDS = 120
_NUMBERS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")
_REST = "The table shows all results."


def summary(results: CampaignResults, verdicts: Sequence[Agreement]) -> str:
    """Return a summary of at most 120 words: the findings, and the agreement of the simulation."""
    last = _agreement(verdicts)
    kept: list[str] = []
    for each in _sentences(results):
        if sum(len(one.split()) for one in (*kept, each, _REST, last)) > MOST_WORDS:
            kept.append(_REST)
            break
        kept.append(each)
    return " ".join((*kept, last)).strip()


def _sentences(results: CampaignResults) -> Iterator[str]:
    without = sum(each.what is FailedStep.ANALYSIS for each in results.failures)
    if without:
        of_all = without + len(results.results)
        yield f"{_count(without, 'recording').capitalize()} of {_number(of_all)} gave no result."
    noise, dwells, alone = results.noise, results.dwells, results.in_order
    if len({_level(each) for each in noise}) == len(noise) and _is_one_specimen(noise):
        yield from _levels(noise)
        alone = tuple(each for each in alone if each not in noise)
    if _is_one_specimen(dwells):
        yield from _motions(dwells)
        alone = tuple(each for each in alone if each not in dwells)
    for each in alone:
        name = f"{each.analysis.facts.name}: " if len(alone) > 1 else ""
        yield f"{name}{result_sentence(each)}"


def _levels(noise: Sequence[NoiseResult]) -> Iterator[str]:
    """Yield sentences on the resonances at the weakest noise, and on how they change up to the strongest."""
    if not noise:
        return
    weak, strong = noise[0], noise[-1]
    yield _resonances(weak)
    if weak is strong:
        return
    before, after = (each.analysis.response.resonances for each in (weak, strong))
    if not before or not after or _band(weak) != _band(strong):
        yield _resonances(strong)
        return
    gone = [each.frequency_hz for each in before if nearest_resonance(each.frequency_hz, after) is None]
    new = [each.frequency_hz for each in after if nearest_resonance(each.frequency_hz, before) is None]
    kept = [each.frequency_hz for each in after if each.frequency_hz not in new]
    if len(gone) == len(before) > 1:
        others = "a new one appears" if len(new) == 1 else f"{_number(len(new))} new ones appear"
        yield f"At {_level(strong)} these resonances disappear, and {others} at {_list_hz(new)} Hz."
        return
    parts = [
        f"{_list_hz(some)} Hz {one if len(some) == 1 else several}"
        for some, one, several in (
            (kept, "remains", "remain"),
            (gone, "disappears", "disappear"),
            (new, "is new", "are new"),
        )
        if some
    ]
    yield f"At {_level(strong)}, {'; '.join(parts)}."


def _resonances(result: NoiseResult) -> str:
    found = [each.frequency_hz for each in result.analysis.response.resonances]
    if not found:
        return f"At {_level(result)} there is no significant resonance."
    verb = "is" if len(found) == 1 else "are"
    return f"At {_level(result)} there {verb} {_count(len(found), 'resonance')}, at {_list_hz(found)} Hz."


def _motions(dwells: Sequence[DwellResult]) -> Iterator[str]:
    """Yield one sentence per dwell frequency on the kind of motion at each level."""
    by_place: dict[float, dict[str, list[str]]] = {}
    for each in dwells:
        kinds = by_place.setdefault(each.analysis.excitation.frequency_hz, {})
        levels = kinds.setdefault(each.analysis.motion.verdict.text, [])
        levels.append(f"{each.analysis.excitation.amplitude_vpp:g}")
    for frequency_hz, kinds in by_place.items():
        texts = [f"{kind} at {_join(list(dict.fromkeys(levels)))} Vpp" for kind, levels in kinds.items()]
        yield f"At {frequency_hz:g} Hz the motion is {_join(texts)}."


def _agreement(verdicts: Sequence[Agreement]) -> str:
    if not verdicts:
        return ""
    if len(set(verdicts)) == 1:
        every = ("the recording", "both recordings", f"all {_count(len(verdicts), 'recording')}")
        which = every[min(len(verdicts), len(every)) - 1]
        return {
            Agreement.YES: f"The simulation agrees with {which}.",
            Agreement.NO: f"The simulation disagrees with {which}.",
            Agreement.OPEN: "Agreement with a simulation was not determined.",
        }[verdicts[0]]
    texts = zip(("agrees with", "disagrees with", "was not compared with"), Agreement, strict=True)
    parts = [f"{text} {_number(count)}" for text, each in texts if (count := verdicts.count(each))]
    return f"Of {_count(len(verdicts), 'recording')}, the simulation {_join(parts)}."


def _level(result: NoiseResult) -> str:
    return f"{result.analysis.excitation.amplitude_vpp:g} Vpp"


def _band(result: NoiseResult) -> tuple[float, float]:
    """Return the measured band, rounded because two converter clocks differ by a few ppm."""
    found = result.analysis.response.frequency_response.frequency_hz
    return round(float(found[0])), round(float(found[-1]))


def _is_one_specimen(results: Sequence[AnyResult]) -> bool:
    first, *others = [each.analysis.facts.bench.get("specimen") for each in results] or [None]
    return all(each == first for each in others)


def _list_hz(values_hz: Sequence[float]) -> str:
    return _join([f"{each:.1f}" for each in values_hz])


def _join(parts: Sequence[str]) -> str:
    *first, last = parts
    return f"{', '.join(first)} and {last}" if first else last


def _number(count: int) -> str:
    return _NUMBERS[count] if count < len(_NUMBERS) else str(count)


def _count(count: int, noun: str) -> str:
    return f"{_number(count)} {noun}{'' if count == 1 else 's'}"


def measured_table(facts: RecordingFacts) -> ReportTable:
    """Return a table of the measurement plan, its start, its duration and how it ended."""
    plan = facts.measurement
    reason = f": {facts.reason}" if facts.reason else ""
    rows = (
        ("excitation", excitation_text(plan.excitation.model_dump(mode="json"))),
        ("ramps", f"{plan.ramp_s:g} s, half cosine"),
        ("started", f"{facts.started_utc[:19].replace('T', ' ')} UTC"),
        ("length", f"{facts.duration_s:.2f} s, {facts.sample_rate_hz:.6g} samples/s"),
        ("ended", f"{facts.state.value}{reason}"),
        ("file", f"{facts.path.name}, id {facts.recording_id}"),
        *((("notes", plan.notes),) if plan.notes else ()),
    )
    return ReportTable("Recording", (), rows)


def excitation_text(plan: Mapping[str, Any]) -> str:
    """Return a plan as one line of text with all its numbers."""
    rest = [
        f"{key} = {value}" for key, value in plan.items() if key != "kind" and not isinstance(value, list)
    ]
    return f"{str(plan['kind']).replace('_', ' ')}: {', '.join(rest)}"


def bench_table(facts: RecordingFacts) -> ReportTable:
    """Return a table of the bench, its instruments, and the settings that were confirmed by hand."""
    rows = [("bench", str(facts.bench.get("name", "not named")))]
    rows += [
        (part, f"{who.maker} {who.model}, serial {who.serial}, firmware {who.firmware}")
        for part, who in facts.instruments.items()
    ]
    rows += [(name, str(value)) for name, value in facts.confirmations.items()]
    rows += [
        (part, _part_name(facts.bench[part]))
        for part in ("amplifier", "shaker", "vibrometer", "accelerometer")
        if facts.bench.get(part)
    ]
    specimen = facts.bench.get("specimen")
    if specimen:
        values = (f"{k} = {_value(v)}" for k, v in specimen.items() if v is not None and k != "sources")
        rows.append(("specimen", ", ".join(values)))
    rows.append(("bench check", bench_check_text(facts)))
    rate = f"{facts.sample_rate_hz:.6g} samples/s, {facts.requested_sample_rate_hz:.6g} requested"
    rows.append(("sample rate", rate))
    return ReportTable("Bench", (), tuple(rows))


def bench_check_text(facts: RecordingFacts) -> str:
    """Return a text with result and age of the last bench check, and with all findings that are not ok."""
    check = facts.bench_check
    if not check:
        return "none"
    before = datetime.fromisoformat(facts.started_utc) - datetime.fromisoformat(str(check["checked"]))
    odd = [
        f"{each['name']} {each['value']} ({each['verdict']}; expected {each['expected']})"
        for each in check["findings"]
        if each["verdict"] != "ok"
    ]
    head = f"{check['verdict']}, {before / timedelta(hours=1):.1f} h before this recording"
    return ": ".join([head, "; ".join(odd)]) if odd else head


def _part_name(part: Mapping[str, Any]) -> str:
    plain = [f"{key} = {value}" for key, value in part.items() if isinstance(value, (int, float))]
    head = f"{part.get('model', '')}, serial {part.get('serial') or 'not given'}"
    return ", ".join([head, *plain])


def _value(value: Any) -> str:
    is_sourced = isinstance(value, dict) and value.keys() >= {"value", "source"}
    return f"{value['value']:g} ({value['source']})" if is_sourced else str(value)


_HEADINGS = "channel, input, sensor, serial, sensitivity, range, coupling, calibrated, delay"


def channel_table(facts: RecordingFacts) -> ReportTable:
    """Return a table of every channel's settings and calibration."""
    rows = tuple(
        (
            each.header.role.replace("_", " "),
            each.header.physical_channel,
            each.header.long_name,
            each.header.serial or "–",
            "–"
            if each.header.sensitivity is None
            else f"{each.header.sensitivity:.5g} {each.header.sensitivity_unit}",
            f"±{each.header.range_v:g} V",
            each.header.coupling,
            each.header.calibration_date or "–",
            f"{1e6 * each.header.delay_s:g} µs",
        )
        for each in facts.channels
    )
    return ReportTable("Channels", tuple(_HEADINGS.split(", ")), rows)


def version_table(facts: RecordingFacts) -> ReportTable:
    """Return a table of the program versions that made the recording."""
    provenance = facts.provenance
    packages = ", ".join(f"{name} {which}" for name, which in dict(provenance.get("packages", {})).items())
    rows = (
        ("packages", packages),
        ("commit", str(provenance.get("commit") or "not from a checkout")),
        ("python", str(provenance.get("python", ""))),
        ("platform", str(provenance.get("platform", ""))),
    )
    return ReportTable("Versions that made the recordings", (), rows)


CHANGE_A_CONCLUSION = frozenset({"How it ended", "Seal", "Copies", "Overloads", "Drop-outs", "Drive level"})
"""Checks whose warnings mean a wrong or unplanned result; other warnings only limit its validity."""
_MOST_NUMBERS = 3


def write_report(
    results: CampaignResults,
    path: Path,
    figures_folder: Path | None = None,
    diagrams: "Sequence[BranchDiagram]" = (),
    hidden: "Sequence[HiddenMotion]" = (),
    maps: "Sequence[MapResults]" = (),
    drawn: Mapping[AnyResult, Card] = MappingProxyType({}),
) -> Path:
    """Write one HTML file with all figures; replace an older report of the same name.

    Raises NotEnoughData when there are neither results nor failures to report.

    Parameters
    ----------
    results
        Results of `analyse_files`, of a whole campaign or of one recording.
    path
        Path of the HTML file; its folder is created.
    figures_folder
        Folder for PNG, SVG and CSV of each figure; nothing is saved if None.
    diagrams
        Computed branches, drawn with the results of stepped sines and sweeps.
    hidden
        Estimated hidden motions of these recordings.
    maps
        Maps, drawn with the levels of stepped sines and sweeps.
    drawn
        Cards of some results from `draw_cards`; only the remaining figures are drawn now.
    """
    if not results.results and not results.failures:
        raise NotEnoughData(f"{results.name!r} has no recordings, so there is nothing to report")
    cards = [drawn.get(each) or _card(each, results) for each in results.in_order]
    together = [*figures_together(results)]
    if diagrams or maps or hidden:
        from ._maps import model_figures  # noqa: PLC0415 - few reports need the code of these models

        together += model_figures(results, diagrams, maps, hidden)
    first = together.pop(0) if len(cards) > 1 and together else next((each.figure for each in cards), None)
    page = Page(
        title=results.name,
        about=_about(results),
        warnings=(
            *(f"No {each.what}: {each.with_recording}" for each in results.failures),
            *check_warnings(results, CHANGE_A_CONCLUSION),
        ),
        findings=summary(results, [each.agreement for each in cards]),
        figure=first,
        noun="recording",
        cards=(
            *cards,
            *(
                Card(each.name, f"No result: {each.sentence}", Agreement.OPEN, "")
                for each in results.failures
                if each.what is FailedStep.ANALYSIS
            ),
        ),
        further=Fold("Recordings together, and the model", results.model_sentences, figures=tuple(together)),
        folds=tuple(_benches(results)),
        limits=tuple(limits(results)),
    )
    return write_page(page, path, figures_folder)


def _about(results: CampaignResults) -> str:
    origins = {each.is_simulated for each in results.facts}
    unread = sum(each.what is FailedStep.ANALYSIS for each in results.failures)
    count = len(results.facts) + unread
    which = "Some of these recordings come" if len(origins) > 1 or unread else "These recordings come"
    subject = "This recording comes" if count == 1 else which
    where = f" {subject} from {'simulated instruments' if True in origins else 'a real bench'}."
    return f"Report of {count} recording{'' if count == 1 else 's'}.{where if origins else ''}"


def draw_cards(results: CampaignResults) -> dict[AnyResult, Card]:
    """Return the card of each result for `write_report`, with images drawn and figures freed."""
    return {each: _card(each, results, is_drawn=True) for each in results.results}


def _card(result: AnyResult, results: CampaignResults, *, is_drawn: bool = False) -> Card:
    failed = {each.name.removesuffix(".part").removesuffix(".h5"): each for each in results.failures}
    facts, drawing = result.analysis.facts, DRAWINGS[result.kind]
    figure, *more = drawing.figures(result)
    settings = recording_figures(result)
    if is_drawn:
        for each in (figure, *more, *settings):
            each.release()
    agreement, look_at = agreement_of(result, failed.get(facts.name))
    warned = [each for each in result.analysis.checks if each.verdict is Verdict.WARNING]
    checks = tuple((each.verdict.value, each.what, each.text) for each in result.analysis.checks)
    return Card(
        name=facts.name,
        result=result_sentence(result),
        agreement=agreement,
        look_at="; ".join(filter(None, (look_at, ", ".join(each.what.lower() for each in warned)))),
        numbers=tuple(islice(drawing.numbers(result), _MOST_NUMBERS)),
        warnings=tuple(f"{each.what}: {each.text}" for each in warned),
        figure=figure,
        folds=(
            Fold(
                "Statistics and uncertainty",
                tables=(*(build((result,)) for build in drawing.tables), uncertainty_table((result,))),
                figures=tuple(more),
            ),
            Fold(
                "Checks, settings and levels",
                tables=(ReportTable("Checks", (), checks), measured_table(facts)),
                figures=settings,
            ),
        ),
    )


def agreement_of(result: AnyResult, failure: AnalysisFailure | None) -> tuple[Agreement, str]:
    """Return whether the measurement could be one of the simulated draws, and a remark or the reason why not.

    Parameters
    ----------
    failure
        Failure of the simulation; None if it did not fail.
    """
    overlay = result.overlay
    if overlay is None:
        return Agreement.OPEN, "not simulated" if failure is None else failure.sentence
    if not overlay.run.driven.by_voltage:
        return (
            Agreement.OPEN,
            f"simulated once, from the recorded base{overlay.run.why and ': '}{overlay.run.why}",
        )
    outside = [each.name for each in overlay.ensemble if each.compared and not each.agrees]
    if outside:
        known = f". {overlay.run.why}" if overlay.run.why else ""
        return Agreement.NO, f"outside of the simulated draws: {', '.join(outside)}{known}"
    compared, every = sum(each.compared > 0 for each in overlay.ensemble), len(overlay.ensemble)
    if not compared:
        return Agreement.OPEN, "too few draws have the same kind of motion as the measurement"
    return Agreement.YES, "" if compared == every else f"{compared} of {every} quantities were compared"


def check_warnings(results: CampaignResults, checks: frozenset[str] | None = None) -> Iterator[str]:
    """Yield warnings of checks that should be read before a result is trusted.

    Each warning is one sentence that starts with the name of the recording.

    Parameters
    ----------
    results
        Results of `vibench.analysis.analyse_files`.
    checks
        Names of the checks to include; by default all.
    """
    for result in results.results:
        for check in result.analysis.checks:
            if check.verdict is Verdict.WARNING and (checks is None or check.what in checks):
                yield f"{result.analysis.facts.name}: {check.what.lower()}: {check.text}"


def _benches(results: CampaignResults) -> Iterator[Fold]:
    """Yield one folded section per bench, with the names of its recordings; each bench is described once."""
    groups: dict[tuple[ReportTable, ...], list[str]] = {}
    for facts in results.facts:
        bench_tables = (bench_table(facts), channel_table(facts), version_table(facts))
        groups.setdefault(bench_tables, []).append(facts.name)
    for tables, names in groups.items():
        yield Fold("Bench, settings and versions", (f"Recordings: {', '.join(names)}",), tables)
