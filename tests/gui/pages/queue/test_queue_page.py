"""Edits of the Queue page change the displayed campaign."""

import pytest

from vibench.acquisition import load_campaign, shipped
from vibench.gui.pages.queue.queue_page import QueuePage


@pytest.fixture
def page(shared_context, closing):
    return closing(QueuePage(shared_context))


@pytest.mark.thorough
def test_rows_of_an_earlier_campaign_cannot_be_removed(page, wait_for):
    """The second of two quick removals removed a wrong entry or raised an error."""
    page.open_file(shipped("campaigns/quick.toml"))
    first = load_campaign(shipped("campaigns/quick.toml"))
    wait_for(lambda: page.entries.rowCount() > 1)
    last = page.entries.rowCount() - 1
    page.entries.selectRow(last)
    page._remove()
    shorter = page.context.selection.campaign
    assert shorter != first
    page._remove()
    page._move_up()
    assert page.context.selection.campaign == shorter
    wait_for(page.entries.isEnabled)
    assert page.entries.rowCount() == last
    page._remove()
    assert page.context.selection.campaign != shorter
