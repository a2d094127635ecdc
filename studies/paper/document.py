"""The page on what of the paper holds, as Markdown and as a report, made from judgements."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from vibench.analysis.report import Agreement, Card, DrawnFigure, Fold, Page, ReportTable
from vibench.sim import wilson_share

from .claim import Claim, Expectation, Finding, Judgement, Verdict
from .page_tables import score_table
from .score import DampingScore

_HEADINGS = ("claim", "where", "measured", "wanted", "verdict")
HEAD = f"| {' | '.join(_HEADINGS)} |"
_RULE = "|---|---|---|---|---|"
_PIPE = "&#124;"
"""A bar inside of a cell."""
_METHOD = (
    "Every claim of Gong et al. (2025) that has a number or a direction, measured on our simulation of",
    "their specimen, with what we want to see and the verdict. Chaotic motion is a draw: another run of",
    "it differs by some per cent, and the bounds are wide enough for that. Where it is chance which",
    "motion chaos ends in, or when, a claim is measured from several starts, a millionth of the gap",
    "apart, and the spread of each number stands behind it. The paper gives hardly any",
    "tolerances: the bounds are ours, and some were settled after a first look at the numbers. Where a",
    "claim does not hold, options are tried one by one, in the order listed, until one upholds it.",
    "The experiment of Figs. 12 to 14 is repeated on the virtual rig by `vibench demo`.",
)
COMMAND = "vibench reproduce --out DIR --markdown docs/reproduction.md"


@dataclass(frozen=True)
class Reproduction:
    """Everything that the page is made of."""

    sections: Mapping[str, tuple[Judgement, ...]]
    """By heading, in order."""
    scores: tuple[DampingScore, ...]
    tables: tuple[ReportTable, ...]
    """After the claims."""
    options: str
    """The defaults, as a sentence."""
    made_with: str
    """Versions that computed it, and how long that took."""

    @property
    def judgements(self) -> tuple[Judgement, ...]:
        """Of all sections."""
        return tuple(each for section in self.sections.values() for each in section)

    def count(self, verdict: Verdict) -> int:
        """How many claims have this verdict."""
        return sum(each.verdict is verdict for each in self.judgements)

    @property
    def sentence(self) -> str:
        """The counts in words."""
        return (
            f"Of {len(self.judgements)} claims {self.count(Verdict.HOLDS)} hold under the defaults, "
            f"{self.count(Verdict.HOLDS_FOR_SHARE)} for a share of starts, "
            f"{self.count(Verdict.HOLDS_UNDER)} under another named option, "
            f"{self.count(Verdict.FAILS)} under none that was tried."
        )


def reproduction_document(found: Reproduction, pictures: Sequence[tuple[str, str]] = ()) -> str:
    """Write the page, with pictures by title and path relative to it."""
    return "\n".join(_lines(found, pictures)) + "\n"


def _lines(found: Reproduction, pictures: Sequence[tuple[str, str]]) -> Iterator[str]:
    yield from _summary(found)
    for heading, judgements in found.sections.items():
        yield from ("", f"## {heading}", "", HEAD, _RULE)
        for each in judgements:
            yield _row(each)
        yield from _differing(judgements)
        yield from ("", "How each was measured:", "")
        yield from (f"- **{each.claim.key}**: {each.claim.measured_by}" for each in judgements)
    for table in (score_table(found.scores), *found.tables):
        yield from _table(table)
    for title, path in pictures:
        yield from ("", f"![{title}]({path})")


def _summary(found: Reproduction) -> Iterator[str]:
    yield from (
        "# What of the paper holds",
        "",
        f"Made by `{COMMAND}`; not edited by hand.",
        *_METHOD,
        "",
        found.options,
        found.made_with,
        "",
        found.sentence.replace(", ", ",\n"),
    )
    apart = [each for each in found.judgements if each.verdict is not Verdict.HOLDS]
    if apart:
        yield from ("", "Where we differ from the paper:", "")
    for each in apart:
        yield f"- **{each.claim.key}**: {each.claim.says} {_difference(each)}"


def _difference(judgement: Judgement) -> str:
    """Say what we find instead, and which option would make us meet."""
    ours = (
        f"We find {_values(judgement.claim, judgement.findings[0])}; wanted {wanted_text(judgement.claim)}."
    )
    under = judgement.met_under
    meets = (
        f" None of {len(judgement.findings) - 1} options tried would make us meet{_except(judgement)}."
        if under is None
        else f" We meet under {under.case.name}: {_values(judgement.claim, under)}."
    )
    remark = f" {judgement.claim.remark}" if judgement.claim.remark else ""
    return ours + (meets if len(judgement.findings) > 1 else "") + remark


def _except(judgement: Judgement) -> str:
    """Say under which options some starts uphold a claim that all of none does."""
    return "".join(
        f", except {each.case.name} for {each.met} of {len(each.draws)} starts"
        for each in judgement.findings
        if each.is_met_in_part
    )


def _table(table: ReportTable) -> Iterator[str]:
    yield from ("", f"## {table.title}", "", table.note, "")
    yield _line(table.headings)
    yield f"|{'---|' * len(table.headings)}"
    yield from map(_line, table.rows)


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(each.replace('|', _PIPE) for each in cells)} |"


def _row(judgement: Judgement) -> str:
    key, *cells, verdict = _cells(judgement)
    bold = verdict.replace(Verdict.FAILS, f"**{Verdict.FAILS}**", 1)
    return _line((f"**{judgement.claim.key}**{key.removeprefix(judgement.claim.key)}", *cells, bold))


def _cells(judgement: Judgement) -> tuple[str, ...]:
    claim = judgement.claim
    return (
        f"{claim.key}: {claim.says}",
        claim.place,
        _values(claim, judgement.findings[0]),
        wanted_text(claim),
        verdict_text(judgement),
    )


def verdict_text(judgement: Judgement) -> str:
    """Say the verdict, with the option that it rests on."""
    under, first = judgement.met_under, judgement.findings[0]
    if judgement.verdict is Verdict.HOLDS_FOR_SHARE:
        share = wilson_share(first.met, len(first.draws))
        return (
            f"{judgement.verdict.value}: {first.met} of {len(first.draws)} "
            f"({100 * share.low:.0f} to {100 * share.high:.0f} %)"
        )
    if judgement.verdict is Verdict.HOLDS_UNDER and under is not None:
        return f"holds under {under.case.name}"
    if judgement.verdict is Verdict.HOLDS:
        return judgement.verdict.value
    return f"{judgement.verdict.value}{_except(judgement)}"


def _values(claim: Claim, finding: Finding) -> str:
    return "; ".join(_value(wanted, finding, number) for number, wanted in enumerate(claim.wanted))


def _value(wanted: Expectation, finding: Finding, number: int) -> str:
    """Say one number, and its spread over starts where there are several."""
    said = f"{wanted.name}: {wanted.shown(finding.values[number])}"
    if len(finding.draws) < 2:
        return said
    low, high = finding.spread(number)
    return f"{said} ({wanted.shown(low, '')} to {wanted.shown(high)} over {len(finding.draws)} starts)"


def wanted_text(claim: Claim) -> str:
    """Say what a claim wants."""
    return "; ".join(each.sentence for each in claim.wanted)


def _differing(judgements: Sequence[Judgement]) -> Iterator[str]:
    """Say what was tried where the defaults do not uphold a claim."""
    for each in judgements:
        if len(each.findings) > 1:
            yield from ("", f"Tried for **{each.claim.key}**:", "")
            yield from (f"- {tried}" for tried in _tried(each))


def _tried(judgement: Judgement) -> Iterator[str]:
    for finding in judgement.findings:
        yield f"{finding.case.name}: {_values(judgement.claim, finding)} ({_mark(finding)})"


def _mark(finding: Finding) -> str:
    if finding.is_met_in_part:
        return f"holds for {finding.met} of {len(finding.draws)} starts"
    return "holds" if finding.is_met else "does not hold"


def reproduction_page(found: Reproduction, levels: DrawnFigure, score: DrawnFigure) -> Page:
    """Show the judgements as the report of recordings does: one card for each section of claims.

    Parameters
    ----------
    levels
        Responses at every drive level, the first figure.
    score
        How many claims hold at each damping.

    """
    failed = [each.claim.key for each in found.judgements if each.verdict is Verdict.FAILS]
    missing = f" Those that do not hold: {', '.join(failed)}." if failed else ""
    return Page(
        title="What of the paper holds",
        about="Claims of Gong et al. (2025), measured on our simulation of their specimen.",
        warnings=(),
        findings=found.sentence + missing,
        figure=levels,
        noun="claims on",
        cards=tuple(_card(heading, judgements) for heading, judgements in found.sections.items()),
        further=Fold("Score by damping", figures=(score,)),
        folds=(Fold("All scores and settings", tables=(score_table(found.scores), *found.tables)),),
        limits=(" ".join(_METHOD), found.options, found.made_with),
    )


def _card(heading: str, judgements: Sequence[Judgement]) -> Card:
    verdicts = [each.verdict for each in judgements]
    apart = [each for each in judgements if each.verdict is not Verdict.HOLDS]
    rows = tuple(_cells(each) for each in judgements)
    tried = tuple(
        (each.claim.key, text) for each in judgements if len(each.findings) > 1 for text in _tried(each)
    )
    how = tuple((each.claim.key, each.claim.measured_by) for each in judgements)
    return Card(
        name=heading,
        result=f"{verdicts.count(Verdict.HOLDS)} of {len(verdicts)} claims hold under the defaults.",
        agreement=Agreement.NO if Verdict.FAILS in verdicts else Agreement.OPEN if apart else Agreement.YES,
        look_at=", ".join(each.claim.key for each in apart),
        numbers=tuple(
            (f"claims: {each.value}", str(verdicts.count(each))) for each in Verdict if each in verdicts
        ),
        folds=(
            Fold(
                "Claims, what was tried and how it was measured",
                tuple(f"{each.claim.key}: {each.claim.says} {_difference(each)}" for each in apart),
                (
                    ReportTable("Claims", _HEADINGS, rows),
                    ReportTable("Tried", ("claim", "option: result"), tried),
                    ReportTable("How each was measured", ("claim", "measured by"), how),
                ),
            ),
        ),
    )
