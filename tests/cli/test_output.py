"""Tables in 80 columns or fewer: words wrap, and numbers are not cut."""

import pytest
from rich.console import Console
from rich.table import Table

from vibench.cli import output

NUMBERS = ["4.121e-03", "-0.001234", "12345678.9"]


@pytest.fixture
def page(monkeypatch, request):
    console = Console(width=request.param, highlight=False, soft_wrap=True, record=True)
    monkeypatch.setattr(output, "console", console)
    return console


@pytest.mark.parametrize("page", [20, 40, 80], indirect=True)
def test_numbers_are_not_cut_in_narrow_tables(page):
    rows = Table(title="Numbers")
    for heading in (*(f"quantity {number}" for number in range(9)), "words"):
        rows.add_column(heading, justify="right")
    rows.add_row(*(NUMBERS * 3), "periodic, as far as it was followed")
    output.print_table(rows)
    text = page.export_text()
    assert [text.count(number) for number in NUMBERS] == [3, 3, 3]
    assert "\u2026" not in text


def test_the_full_table_of_a_prediction_fits_a_terminal_of_80_characters(vibench_here, tmp_path):
    asked = ("--model", "linear", "--observe", "response,lyapunov", "--frequency", "90:100:5")
    told = vibench_here("predict", "--amplitude", "3e-7", *asked, cwd=tmp_path, environment={"COLUMNS": "80"})
    assert told.returncode == 0, told.stderr
    assert "exponent" in told.stdout
    assert max(len(line.rstrip()) for line in told.stdout.splitlines()) <= 80
    assert "\u2026" not in told.stdout
