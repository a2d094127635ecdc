"""Shipped files are found by name from any folder; a user's file takes precedence."""

import pytest

from vibench.acquisition import ConfigurationError, all_shipped, file_path, load_campaign, shipped_folder


def test_a_bare_name_loads_a_shipped_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for folder in ("campaigns", "hardware_configs", "hardware_configs/faults", "studies"):
        for path in all_shipped(folder):
            assert file_path(path.stem, folder) == path
    assert load_campaign("quick").name == "quick"


def test_a_user_file_takes_precedence_over_a_shipped_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "quick").write_text("", encoding="utf-8")
    assert file_path("quick", "campaigns").resolve() == tmp_path / "quick"


@pytest.mark.parametrize("given", ["quick.toml", "campaigns/quick"])
def test_a_path_never_loads_a_shipped_file(given, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ConfigurationError, match=r"missing|not exist|no such|cannot be read"):
        load_campaign(given)


def test_an_unknown_file_name_is_refused_with_a_list_of_known_names(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ConfigurationError, match=r"'quik' is not a file.* paper, quick, "):
        load_campaign("quik")
    with pytest.raises(ConfigurationError, match="not part of this installation"):
        shipped_folder("recipes")


def test_a_folder_does_not_hide_a_shipped_file_of_the_same_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "virtual_rig").mkdir()  # as in the folder of a checkout
    assert file_path("virtual_rig", "hardware_configs").name == "virtual_rig.toml"
    (tmp_path / "mine").mkdir()
    with pytest.raises(ConfigurationError, match="'mine' is a folder, and vibench has no file of"):
        load_campaign("mine")
