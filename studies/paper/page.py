"""The page on the claims of the paper: its sections, as Markdown and as a report."""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vibench.analysis.report import Agreement, Card, DrawnFigure, Fold, Page, ReportTable
from vibench.sim import wilson_share
from vibench.sim.study import software

from . import (
    balance_claims,
    collision_claims,
    exponent_claims,
    resonance_claims,
    similarity_claims,
    spectrum_claims,
)
from .claim import Claim, Expectation, Finding, Judgement, Verdict, judgement
from .options import Case
from .reading import Evidence
from .settings import DampingScore, claims_by_setting, score_table, scores

_HEADINGS = ("claim", "section, figure", "measured", "required", "verdict")
HEAD = f"| {' | '.join(_HEADINGS)} |"
_TITLE = "Claims of the paper, checked by simulation"
_METHOD = """\
Each claim of Gong et al. (2025) with a number or direction is checked by simulating their specimen.
The paper states few tolerances, so we chose the required bounds, some of them after seeing first results.
The bounds allow for chaos, in which responses differ by some per cent between runs.
"Strict reading" takes the paper's words literally. "A over B" is the ratio A / B.
If the duration of chaos is random, a claim is checked with several starts (initial states a millionth of the
gap apart), and parentheses show the range of the results. If a claim fails, options are tried in order until
the claim holds. A0 is the base amplitude, and n is the power of a continuous contact law. "Exponent" is the
largest Lyapunov exponent. Similarity is the share of frequencies at which two models agree (eq. 7).
DIR/report.html describes each measurement."""
SECTIONS: dict[str, tuple[Claim, ...]] = {
    heading: tuple(each for each in vars(module).values() if isinstance(each, Claim))
    for heading, module in {
        "Resonances": resonance_claims,
        "Collisions": collision_claims,
        "Chaos": exponent_claims,
        "Motion at 260 Hz": spectrum_claims,
        "Analytical solution of the continuous model": balance_claims,
        "Similarity of the models": similarity_claims,
    }.items()
}
"""Claims by heading; within a section, claims have the order of the section's source file."""
CLAIMS = tuple(claim for claims in SECTIONS.values() for claim in claims)
COMMAND = "vibench reproduce --out DIR --markdown docs/reproduction.md"


@dataclass(frozen=True)
class Reproduction:
    """Content of the page on the paper's claims."""

    sections: Mapping[str, tuple[Judgement, ...]]
    scores: tuple[DampingScore, ...]
    tables: tuple[ReportTable, ...]
    options: str
    """The default options, in words."""
    made_with: str
    """Number of computed points, processor time and version, as text."""

    @property
    def judgements(self) -> tuple[Judgement, ...]:
        """Judgements of the claims in all sections."""
        return tuple(each for section in self.sections.values() for each in section)

    def count(self, verdict: Verdict) -> int:
        """Return the number of claims with this verdict."""
        return sum(each.verdict is verdict for each in self.judgements)

    @property
    def sentence(self) -> str:
        """The number of claims with each verdict, in words."""
        return (
            f"Of {len(self.judgements)} claims {self.count(Verdict.HOLDS)} hold under the defaults, "
            f"{self.count(Verdict.HOLDS_FOR_SHARE)} under the defaults for some starts only, "
            f"{self.count(Verdict.HOLDS_UNDER)} under another named option, "
            f"{self.count(Verdict.FAILS)} under no option tested."
        )


def reproduction(
    sections: Mapping[str, tuple[Claim, ...]], evidence: Evidence, case: Case, on_step: Callable[[str], None]
) -> Reproduction:
    """Measure every claim for a case, with its alternatives, at every damping and with every setting."""

    def judged(claim: Claim) -> Judgement:
        on_step(claim.key)
        return judgement(claim, evidence, case)

    judgements = {heading: tuple(map(judged, claims)) for heading, claims in sections.items()}
    every = [claim for each in sections.values() for claim in each]
    on_step("score by damping")
    by_damping = scores(every, evidence, case)
    on_step("claims by setting")
    by_setting = claims_by_setting(every, evidence, case)
    tables = (score_table(by_damping), by_setting)
    return Reproduction(judgements, by_damping, tables, case.choices, _origin_text(evidence))


def _origin_text(evidence: Evidence) -> str:
    """Return the number of computed points, the processor time and vibench's version, as text."""
    studies = evidence.studies
    points = sum(each.study.grid.size for each in studies)
    minutes = sum(float(np.nansum(each.values("taken"))) for each in studies) / 60.0
    return (
        f"Computed from {points} simulated points in {len(studies)} studies, "
        f"{minutes:.0f} minutes on one core, with vibench {json.loads(software())['vibench']}."
    )


def reproduction_document(found: Reproduction, pictures: Sequence[tuple[str, str]] = ()) -> str:
    """Return the page as Markdown; ``pictures`` are titles and paths relative to the page."""
    return "\n".join(_lines(found, pictures)) + "\n"


def _lines(found: Reproduction, pictures: Sequence[tuple[str, str]]) -> Iterator[str]:
    yield from (f"# {_TITLE}", "", f"Made by `{COMMAND}`; do not edit by hand.", _METHOD, "")
    yield from (found.options, found.made_with, "", found.sentence.replace(", ", ",\n"))
    apart = [each for each in found.judgements if each.verdict is not Verdict.HOLDS]
    if apart:
        yield from ("", "Claims that do not hold under the defaults:", "")
    for each in apart:
        yield f"- **{each.claim.key}**: {each.claim.says} {_upholding_options(each)}".rstrip()
    for heading, judgements in found.sections.items():
        yield from ("", f"## {heading}", "", HEAD, f"|{'---|' * len(_HEADINGS)}")
        yield from (_row(each) for each in judgements)
    table = score_table(found.scores)
    yield from ("", f"## {table.title}", "", table.note, "", _line(table.headings))
    yield from (f"|{'---|' * len(table.headings)}", *map(_line, table.rows))
    for title, path in pictures:
        yield from ("", f"![{title}]({path})")


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(each.replace('|', '&#124;') for each in cells)} |"


def _row(result: Judgement) -> str:
    key, *cells, verdict = _cells(result)
    bold = verdict.replace(Verdict.FAILS, f"**{Verdict.FAILS}**", 1)
    return _line((f"**{result.claim.key}**{key.removeprefix(result.claim.key)}", *cells, bold))


def _cells(result: Judgement) -> tuple[str, ...]:
    claim = result.claim
    measured = _values(claim, result.findings[0])
    return f"{claim.key}: {claim.says}", claim.place, measured, target_text(claim), verdict_text(result)


def verdict_text(result: Judgement) -> str:
    """Return the verdict, and the options for which the claim holds if they are not the defaults."""
    text, first, under = result.verdict.value, result.findings[0], result.first_met
    match result.verdict:
        case Verdict.HOLDS_FOR_SHARE:
            share = wilson_share(first.met_draws, len(first.draws))
            return f"{text}: {first.share} ({100 * share.low:.0f} to {100 * share.high:.0f} %)"
        case Verdict.HOLDS_UNDER if under is not None:
            return f"{text} {under.case.name}"
        case Verdict.FAILS:
            return "; ".join([text, *(_part_held(each) for each in result.findings if each.is_met_in_part)])
    return text


def target_text(claim: Claim) -> str:
    """Return the requirements of a claim."""
    sentences = [each.sentence for each in claim.limits]
    return f"each {sentences[0]}" if sentences[1:] and len(set(sentences)) == 1 else "; ".join(sentences)


def _difference(result: Judgement) -> str:
    """Return the measured numbers, the requirements, and the options with which the claim holds."""
    found = _values(result.claim, result.findings[0])
    return f"We find {found}; required {target_text(result.claim)}. {_upholding_options(result)}".strip()


def _upholding_options(result: Judgement) -> str:
    """Return the options with which a claim holds, the numbers measured with them, and the comment."""
    claim, alternatives = result.claim, result.findings[1:]
    sentences = []
    if alternatives and result.first_met is None:
        sentences = [f"The claim fails under all options ({len(alternatives)})."]
    for each in alternatives:
        if each.met_draws > 0:
            where = _part_held(each) if each.is_met_in_part else f"the claim holds under {each.case.name}"
            sentences += [f"{text[0].upper()}{text[1:]}." for text in (where, _values(claim, each))]
    return " ".join([*sentences, claim.remark]).strip()


def _part_held(found: Finding) -> str:
    return f"with {found.case.name} the claim holds for {found.share} starts"


def _values(claim: Claim, found: Finding) -> str:
    text = "; ".join(_value(wanted, found, number) for number, wanted in enumerate(claim.limits))
    return text if len(found.draws) < 2 else f"{text}; from {len(found.draws)} starts"


def _value(wanted: Expectation, found: Finding, number: int) -> str:
    """Return one number as text, with its range over several initial states."""
    value = f"{wanted.name}: {wanted.number_text(found.values[number])}"
    low, high = (wanted.number_text(each, "") for each in found.spread(number))
    return value if low == high else f"{value} ({low} to {high})"


def _tests(result: Judgement) -> Iterator[str]:
    for each in result.findings:
        in_part = f"holds for {each.share} starts"
        mark = in_part if each.is_met_in_part else "holds" if each.is_met else "does not hold"
        yield f"{each.case.name}: {_values(result.claim, each)} ({mark})"


def reproduction_page(found: Reproduction, levels: DrawnFigure, score: DrawnFigure) -> Page:
    """Return the findings as a report with one card per section of claims.

    Parameters
    ----------
    levels
        First figure: responses at every drive level.
    score
        Figure of the number of claims that hold, over damping.
    """
    failed = [each.claim.key for each in found.judgements if each.verdict is Verdict.FAILS]
    missing = f" Claims that do not hold: {', '.join(failed)}." if failed else ""
    return Page(
        title=_TITLE,
        about="Claims of Gong et al. (2025), checked with a simulation of their specimen.",
        warnings=(),
        findings=found.sentence + missing,
        figure=levels,
        noun="claims on",
        cards=tuple(_card(heading, judgements) for heading, judgements in found.sections.items()),
        further=Fold("Score by damping", figures=(score,)),
        folds=(Fold("All scores and settings", tables=found.tables),),
        limits=(" ".join(_METHOD.splitlines()), found.options, found.made_with),
    )


def _card(heading: str, judgements: Sequence[Judgement]) -> Card:
    verdicts = [each.verdict for each in judgements]
    apart = [each for each in judgements if each.verdict is not Verdict.HOLDS]
    tried = [(each.claim.key, text) for each in judgements if len(each.findings) > 1 for text in _tests(each)]
    how = [(each.claim.key, each.claim.measured_by) for each in judgements]
    return Card(
        name=heading,
        result=f"{verdicts.count(Verdict.HOLDS)} of {len(verdicts)} claims hold under the defaults.",
        agreement=Agreement.NO if Verdict.FAILS in verdicts else Agreement.OPEN if apart else Agreement.YES,
        look_at=", ".join(each.claim.key for each in apart),
        numbers=tuple((f"claims: {each}", str(verdicts.count(each))) for each in Verdict if each in verdicts),
        folds=(
            Fold(
                "Claims, options tested, and methods",
                tuple(f"{each.claim.key}: {each.claim.says} {_difference(each)}" for each in apart),
                (
                    ReportTable("Claims", _HEADINGS, tuple(_cells(each) for each in judgements)),
                    ReportTable("Options tested", ("claim", "option: result"), tuple(tried)),
                    ReportTable("Methods", ("claim", "measured by"), tuple(how)),
                ),
            ),
        ),
    )
