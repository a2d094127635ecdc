"""A report page is short with closed folds, escapes text from files and prints on A4."""

import re
from types import SimpleNamespace

import pytest

from tests.reading_reports import Page as Read
from vibench.analysis.report import Agreement, Card, Fold, Page, ReportTable, write_page
from vibench.analysis.report._report import LONGEST_CAPTION, MOST_OPEN_CARDS, split_caption

HOSTILE = '<script>alert("x")</script>'


def page_text(path, cards, text="words"):
    page = Page(text, text, (text,), text, None, "recording", cards, Fold("More", ()), (), (text,))
    return write_page(page, path / "page.html").read_text(encoding="utf-8")


def card(name, text="words"):
    fold = Fold(text, (text,), (ReportTable(text, (text,), ((text,),), text),))
    return Card(name, text, Agreement.OPEN, text, ((text, text),), (text,), folds=(fold,))


@pytest.mark.parametrize("number", [0, 1, MOST_OPEN_CARDS, MOST_OPEN_CARDS + 1, 60])
def test_every_result_card_has_a_table_row_and_many_cards_are_folded(number, tmp_path):
    page = Read(page_text(tmp_path, tuple(card(f"c{each}", "result " * 20) for each in range(number))))
    rows = page.visible.split("figure and remarks")[1].split("Individual results")[0]
    assert rows.count("cannot tell") == number
    assert [each for each in page.ids if each.startswith("card-")] == [
        f"card-{each}" for each in range(1, number + 1)
    ]
    shown = page.visible.split("Individual results")[1].count("result")
    assert shown == (0 if number > MOST_OPEN_CARDS else 100 * number)


def test_html_in_text_from_files_is_escaped_everywhere_in_a_report(tmp_path):
    text = page_text(tmp_path, (card(HOSTILE, HOSTILE),), HOSTILE)
    assert "<script" not in text
    assert Read(text).visible.count(HOSTILE) >= 9


def test_reports_have_a_dark_style_and_a_print_style_and_do_not_print_closed_folds(tmp_path):
    style = page_text(tmp_path, ())
    assert "@media (prefers-color-scheme: dark)" in style
    assert "@page { size: A4" in style
    assert re.search(r"@media print \{.*details:not\(\[open\]\) \{ display: none; \}", style, re.DOTALL)


@pytest.mark.parametrize(
    ("caption", "shown"),
    [
        ("One. Two.", "One. Two."),
        ("Seen in Gong et al. 2025, Fig. 3. " + "Word " * 50 + "end.", "Seen in Gong et al. 2025, Fig. 3."),
        ("Word " * 60 + "end.", ""),
        ("", ""),
    ],
)
def test_long_captions_are_folded_after_three_lines(caption, shown):
    first, rest = split_caption(SimpleNamespace(title="A title", caption=caption))
    assert first == shown
    assert f"{first} {rest}".strip() == caption
    assert len(first) <= LONGEST_CAPTION
