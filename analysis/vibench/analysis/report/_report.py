"""The report of a campaign, or of one recording, as one self-contained HTML file."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import datetime, timedelta
from itertools import islice
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from vibench.sim import Parameter
from vibench.sim.maps import MapResults

from ..comparison import CurveKind, CurveOrigin
from ..dynamics import BranchDiagram, RecordedLevel, recorded_level, specimen_difference
from ..errors import NotEnoughData
from ..figures.dwells import verdict_text
from ..figures.hidden_motion import hidden_impacts_figure, hidden_motion_figure
from ..figures.maps import branches_figure, map_figure
from ..figures.style import DrawnFigure
from ..hidden_motion import HiddenMotion
from ..kinds import ANALYSES, AnyResult, DwellResult, NoiseResult
from ..recordings.checks import Verdict
from ..recordings.facts import RecordingFacts, known_specimen
from ..results.campaign_results import AnalysisFailure, CampaignResults, FailedStep
from ..sine.stepped_response import SteppedResponse, lost_levels, tracked_resonances
from ..sine.sweep import SweepResponse
from ._drawings import DRAWINGS, figures_together, limits, recording_figures, result_sentence
from ._page import Agreement, Card, Fold, Page, ReportTable, write_page
from ._result_tables import nearest_resonance, uncertainty_table

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
        levels = kinds.setdefault(verdict_text(each.analysis.motion.verdict), [])
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


def draw_maps(results: CampaignResults, maps: Sequence[MapResults]) -> Iterator[DrawnFigure]:
    """Draw each map, overlaid with levels and Response I of stepped sines and sweeps."""
    levels = _recorded_levels(results, CurveKind.RESPONSE_I)
    for number, found in enumerate(maps, start=1):
        drawn = map_figure(found, levels=levels if found.plan.is_over_drive else ())
        yield replace(drawn, name=f"map_{number}")


def _recorded_levels(results: CampaignResults, *kinds: CurveKind) -> list[RecordedLevel]:
    """Return level, responses and specimen of each stepped sine and sweep over a range of frequencies."""
    levels = []
    for each in results.in_order:
        facts, found = each.analysis.facts, each.analysis.response
        if isinstance(found, SweepResponse | SteppedResponse):
            with suppress(NotEnoughData):
                level = recorded_level(found.frequency_hz, found.drive_amplitude_m)
                measured = ANALYSES[each.kind].curves(facts.name, CurveOrigin.MEASURED, found)
                shown = [curve for curve in measured if not kinds or curve.response in kinds]
                levels.append(RecordedLevel(facts.name, level, shown, known_specimen(facts.bench)))
    return levels


def draw_branches(results: CampaignResults, diagrams: Sequence[BranchDiagram]) -> Iterator[DrawnFigure]:
    """Draw each branch diagram; diagrams over frequency also show results of stepped sines and sweeps."""
    levels = _recorded_levels(results)
    for number, diagram in enumerate(diagrams, start=1):
        if diagram.request.resonance_band_hz is not None:
            drawn = _backbones(results, diagram)
        elif diagram.request.along is not Parameter.FREQUENCY:
            drawn = branches_figure(diagram)
        else:
            drawn = branches_figure(diagram, [curve for level in levels for curve in level.measured])
            sentences = (_level_sentence(diagram, each) for each in levels)
            drawn = replace(drawn, caption=" ".join((drawn.caption, *sentences)))
        yield replace(drawn, name=f"branches_{number}")


def _backbones(results: CampaignResults, diagram: BranchDiagram) -> DrawnFigure:
    """Draw a computed phase resonance with the tracked resonances near it."""
    low_hz, high_hz = diagram.request.resonance_band_hz or (0.0, 0.0)
    facts = [each.analysis.facts for each in results.in_order]
    bands = [each.measurement.excitation.band_hz for each in facts]
    near = [each for each, band in zip(facts, bands, strict=True) if band[0] < high_hz and low_hz < band[1]]
    drawn = branches_figure(
        diagram, tracked=[track for each in near for track in tracked_resonances(each.feedback)]
    )
    sentences = [_lost_sentence(diagram, level) for each in near for level in lost_levels(each.feedback)]
    for each in near:
        recorded = known_specimen(each.bench)
        sentences.append(specimen_difference(diagram.request.chosen_specimen, recorded, each.name))
    return replace(drawn, caption=" ".join(filter(None, (drawn.caption, *sentences))))


def _lost_sentence(diagram: BranchDiagram, level_m_per_s2: float) -> str:
    """State the model's largest Floquet multipliers at a level without resonance, or that there are none."""
    sizes: list[float] = []
    for line in diagram.lines:
        above = line.amplitude_m * (2.0 * np.pi * line.frequency_hz) ** 2 > level_m_per_s2
        sizes += line.largest_multiplier[1:][above[1:] != above[:-1]].tolist()
    text = f"At {level_m_per_s2:g} m/s² the control did not lock onto a periodic motion;"
    if not sizes:
        return f"{text} the branches contain no periodic motion at this level."
    multipliers = ", ".join(f"{each:.3g}" for each in sizes)
    return f"{text} the largest Floquet multiplier of the modelled motion is {multipliers}."


def _level_sentence(diagram: BranchDiagram, level: RecordedLevel) -> str:
    """State how base amplitude and specimen of a recording differ from those of the branches."""
    request = diagram.request
    ratios = [
        amplitude / request.path.drive(frequency)[1]
        for frequency, amplitude in level.pairs
        if request.start <= frequency <= request.stop
    ]
    name, difference = level.name, level.difference(request.chosen_specimen)
    if not ratios:
        text = f"The drive of {name} was outside the frequency range of the branches."
    else:
        low, high = np.min(ratios), np.max(ratios)
        text = f"The base amplitude of {name} is {low:.2g} to {high:.2g} times the amplitude of the branches."
    return f"{text} {difference}".rstrip()


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
    diagrams: Sequence[BranchDiagram] = (),
    hidden: Sequence[HiddenMotion] = (),
    maps: Sequence[MapResults] = (),
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
    together = [*figures_together(results), *draw_branches(results, diagrams), *draw_maps(results, maps)]
    together += [draw(each) for each in hidden for draw in (hidden_motion_figure, hidden_impacts_figure)]
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
