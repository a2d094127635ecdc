"""The findings of a campaign in plain words, for the first screen of its report."""

from collections.abc import Iterator, Sequence

from ..figures.portraits import verdict_text
from ..kinds.analysis_kind import AnyResult, DwellResult, NoiseResult
from ..results.campaign_results import CampaignResults, FailedStep
from ._drawings import result_sentence
from ._page import Agreement
from ._result_tables import nearest_resonance

MOST_WORDS = 120
_NUMBERS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")
_REST = "The table has the rest."


def summary(results: CampaignResults, verdicts: Sequence[Agreement]) -> str:
    """State what was found, and whether the simulation agrees with each result, in at most 120 words."""
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
    """Say which resonances the weakest noise has, and what has become of them under the strongest."""
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
        others = "another appears" if len(new) == 1 else f"{_number(len(new))} others appear"
        yield f"At {_level(strong)} they are gone and {others} at {_listed(new)} Hz."
        return
    parts = [
        f"{_listed(some)} Hz {one if len(some) == 1 else several}"
        for some, one, several in (
            (kept, "remains", "remain"),
            (gone, "is gone", "are gone"),
            (new, "is new", "are new"),
        )
        if some
    ]
    yield f"At {_level(strong)}, {'; '.join(parts)}."


def _resonances(result: NoiseResult) -> str:
    found = [each.frequency_hz for each in result.analysis.response.resonances]
    if not found:
        return f"At {_level(result)} no resonance stands above its uncertainty."
    verb = "is" if len(found) == 1 else "are"
    return f"At {_level(result)} there {verb} {_count(len(found), 'resonance')}, {_listed(found)} Hz."


def _motions(dwells: Sequence[DwellResult]) -> Iterator[str]:
    """Say at which levels the motion is of which kind, frequency by frequency."""
    by_place: dict[float, dict[str, list[str]]] = {}
    for each in dwells:
        kinds = by_place.setdefault(each.analysis.excitation.frequency_hz, {})
        levels = kinds.setdefault(verdict_text(each.analysis.motion.verdict), [])
        levels.append(f"{each.analysis.excitation.amplitude_vpp:g}")
    for frequency_hz, kinds in by_place.items():
        said = [f"{kind} at {_joined(levels)} Vpp" for kind, levels in kinds.items()]
        yield f"At {frequency_hz:g} Hz the motion is {_joined(said)}."


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
    counts = [
        (text, sum(each is one for each in verdicts))
        for text, one in zip(
            ("agrees with", "disagrees with", "was not compared with"), Agreement, strict=True
        )
    ]
    parts = [f"{text} {_number(count)}" for text, count in counts if count]
    return f"Of {_count(len(verdicts), 'recording')}, the simulation {_joined(parts)}."


def _level(result: NoiseResult) -> str:
    return f"{result.analysis.excitation.amplitude_vpp:g} Vpp"


def _band(result: NoiseResult) -> tuple[float, float]:
    """Return the ends of the measured band, rounded: two clocks differ by some ppm."""
    found = result.analysis.response.frequency_response.frequency_hz
    return round(float(found[0])), round(float(found[-1]))


def _is_one_specimen(results: Sequence[AnyResult]) -> bool:
    first, *others = [each.analysis.facts.bench.get("specimen") for each in results] or [None]
    return all(each == first for each in others)


def _listed(values_hz: Sequence[float]) -> str:
    return _joined([f"{each:.1f}" for each in values_hz])


def _joined(parts: Sequence[str]) -> str:
    *first, last = parts
    return f"{', '.join(first)} and {last}" if first else last


def _number(count: int) -> str:
    return _NUMBERS[count] if count < len(_NUMBERS) else str(count)


def _count(count: int, noun: str) -> str:
    return f"{_number(count)} {noun}{'' if count == 1 else 's'}"
