"""Sensitivities in the units of data sheets are converted, or refused with the right way to write them."""

import tomllib

import pytest

from vibench.acquisition import shipped
from vibench.acquisition.errors import ConfigurationError
from vibench.acquisition.host.toml_file import from_toml
from vibench.acquisition.rig import Rig, volts_per_unit

ACCELERATION, VELOCITY = "m s-2", "m s-1"
G = 9.80665


MEANINGS = {
    (ACCELERATION, 0.1 / G): (
        "100 mV/g", "100mV/g", "  100.  mV / g ", "0.1 V/g", ".1 V/gn", "1e5 uV/g", "1E+5 µV/g",
        "100000 μV/g", "100\u00a0mV/g", "10 g/V",
    ),
    (ACCELERATION, 0.0102): (
        "10.2 mV/(m/s2)", "10.2 mV/(m/s²)", "10.2 mV/(m/s^2)", "10.2 mV/(m/s**2)", "10.2 mV/(m s-2)",
        "10.2 mV/(m·s⁻²)", "10.2 mV/(m*s^-2)", "10.2 mV/ms⁻²", "10.2 mV / ms^-2",
    ),
    (ACCELERATION, 1 / 98): ("98 m/s²/V", "98 (m/s2)/V"),
    (VELOCITY, 4.0): (
        "250 mm/s/V", "250 (mm/s)/V", "0.25 m/s/V", "250e3 µm/s/V", "4 V/(m/s)", "4 mV/(mm/s)",
        "4 mV/(mm s⁻¹)",
    ),
    (VELOCITY, 0.1 / 0.0254): ("100 mV/(in/s)",),
    ("N", 0.0112): ("11.2 mV/N",),
    ("N", 0.05 / (0.45359237 * G)): ("50 mV/lbf",),
    ("m", 12500.0): ("80 µm/V", "12.5 mV/um"),
    ("Pa", 0.05): ("50 mV/Pa",),
}  # fmt: skip


@pytest.mark.parametrize(
    ("text", "unit", "expected"),
    [(text, *meaning) for meaning, texts in MEANINGS.items() for text in texts],
)
def test_sensitivities_in_data_sheet_units_are_converted(text, unit, expected):
    assert volts_per_unit(text, unit) == pytest.approx(expected, rel=1e-14)


NO_SENSITIVITIES = (
    "100 mV", "mV/g", "", "100 mv/g", "100 MV/g", "100 mV/G", "100 mV/kg", "100 mV/g rms", "100 mV/gpk",
    "100 mV/g2", "100 mV/g/V", "100,5 mV/g", "1,000 mV/g", "1 000 mV/g", "1_000 mV/g", "10^2 mV/g",
    "10² mV/g", "１００ mV/g", "100 mV/g ± 10 %",
)  # fmt: skip
NOT_ABOVE_0 = ("-100 mV/g", "0 mV/g", "0 g/V", "nan mV/g", "1e400 mV/g", "1e-310 g/V")


@pytest.mark.parametrize(
    ("text", "unit", "said"),
    [
        ("10 mV/m/s2", ACCELERATION, "two ways; write '10 mV/(m/s2)'"),
        ("10 mV/m/s²", ACCELERATION, "two ways; write '10 mV/(m/s2)'"),
        ("10 mV/m s-2", ACCELERATION, "two ways; write '10 mV/(m s-2)'"),
        ("4 V/m/s", VELOCITY, "two ways; write '4 V/(m/s)'"),
        ("10 pC/g", ACCELERATION, "is a charge"),
        ("1.02 pC/(m/s2)", ACCELERATION, "is a charge"),
        ("4 pC/N", "N", "is a charge"),
        ("100", ACCELERATION, "such as '100 mV/g'"),
        *((text, ACCELERATION, "such as") for text in NO_SENSITIVITIES),
        *((text, ACCELERATION, "number above 0") for text in NOT_ABOVE_0),
        ("250 mm/s/V", ACCELERATION, "such as '100 mV/g'"),
        ("100 mV/g", VELOCITY, "such as '250 mm/s/V'"),
        ("100 mV/g", "N", "such as '11.2 mV/N'"),
    ],
)
def test_ambiguous_or_unknown_sensitivities_are_refused(text, unit, said):
    with pytest.raises(
        ValueError, match="^" + repr(text)[:3].replace("+", r"\+").replace(".", r"\.")
    ) as refused:
        volts_per_unit(text, unit)
    assert said in str(refused.value)


def rig_with(**texts):
    """Read the shipped configuration with other sensitivities."""
    path = shipped("hardware_configs/virtual_rig.toml")
    content = tomllib.loads(path.read_text(encoding="utf-8"))
    for place, value in texts.items():
        table, _, key = place.partition("__")
        content[table][key] = value
    return from_toml(content, Rig, path)


def test_a_hardware_configuration_accepts_data_sheet_units():
    rig = rig_with(
        accelerometer__sensitivity_v_per_m_per_s2="100 mV/g", vibrometer__range_mm_per_s_per_v="4 V/(m/s)"
    )
    assert rig.accelerometer.sensitivity_v_per_m_per_s2 == pytest.approx(0.1 / G)
    assert rig.vibrometer.range_mm_per_s_per_v == pytest.approx(250.0)
    assert rig == Rig.model_validate_json(rig.model_dump_json())


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"accelerometer__sensitivity_v_per_m_per_s2": "10 pC/g"}, "is a charge"),
        ({"accelerometer__sensitivity_v_per_m_per_s2": "0.01"}, "such as '100 mV/g'"),
        ({"accelerometer__sensitivity_v_per_m_per_s2": True}, "give a number"),
        ({"vibrometer__range_mm_per_s_per_v": "100 mV/g"}, "such as '250 mm/s/V'"),
        ({"accelerometer__full_scale_v": "5 V"}, "give a number"),
    ],
)
def test_the_error_for_a_wrong_unit_in_a_hardware_configuration_names_the_key(given, said):
    with pytest.raises(ConfigurationError) as refused:
        rig_with(**given)
    (place,) = given
    assert place.replace("__", ".") in str(refused.value)
    assert said in str(refused.value)
