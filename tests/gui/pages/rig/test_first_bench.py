"""The bench of the command line: an unusable bench is explained and not remembered."""

import pytest

from vibench.acquisition import shipped
from vibench.gui.page.app_context import AppContext, SettingKey, Settings
from vibench.gui.pages.rig import RigPage


@pytest.fixture
def page_with(qapp, tmp_path):
    made = []

    def page_with(bench):
        context = AppContext(Settings(tmp_path / "window.ini"))
        context.first_bench = bench
        page = RigPage(context)
        made.append((context, page))
        return page

    yield page_with
    for context, page in made:
        page.close()
        context.background.close()


@pytest.mark.parametrize(
    ("text", "why"),
    [(None, "cannot be read"), ("name = 3 4", "is not valid TOML"), ("name = 'a'", "generator")],
)
def test_an_unusable_bench_shows_the_reason_and_is_not_remembered(page_with, tmp_path, text, why):
    bench = tmp_path / "bench.toml"
    if text is not None:
        bench.write_text(text, encoding="utf-8")
    page = page_with(bench)
    assert why in page.about.text()
    assert page.choice.rig is None
    page.refresh()
    assert not page.open_button.isEnabled()
    assert page_with(None).choice.rig.name == "virtual rig"


def test_a_usable_bench_is_remembered(page_with):
    lab = shipped("hardware_configs/lab_rig.toml")
    assert page_with(lab).choice.rig.name == "laboratory rig"
    again = page_with(None)
    assert again.choice.rig.name == "laboratory rig"
    assert again.context.settings.text(SettingKey.BENCH) == str(lab)


def test_a_bench_gets_a_warning_when_spring_constants_belong_to_another_mass(page_with, tmp_path):
    bench = tmp_path / "bench.toml"
    text = shipped("hardware_configs/virtual_rig.toml").read_text(encoding="utf-8")
    heavier = "[specimen]\nmasses_kg = [5.8e-3, 3.2e-3, 2e-3]\n"
    bench.write_text(text.replace("[specimen]\n", heavier), encoding="utf-8")
    page = page_with(bench)
    assert page.choice.rig is not None
    assert "⚠ gong2025: stiffnesses changed" in page.about.text()
    assert "⚠" not in page_with(shipped("hardware_configs/virtual_rig.toml")).about.text()
