"""Figures show the data with labels and units, and captions show the results."""

import csv
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest

from vibench.acquisition import open_recording
from vibench.acquisition.plan import (
    Dwell,
    Measurement,
    SettledSine,
    SineSweep,
    SteppedSine,
    StreamedNoise,
    WhiteNoise,
)
from vibench.analysis import Simulation
from vibench.analysis.recordings.checks import measurement_checks
from vibench.analysis.report._drawings import sweep_findings
from vibench.analysis.report._dwells import dwells_figure, spectrum_columns
from vibench.analysis.report._stepped_sine import STEPPED_FREQUENCIES, stepped_sine_figure
from vibench.analysis.report._style import SIMULATED, bench_levels_figure, excitation_figure, with_prefix
from vibench.analysis.report._sweep import regions_text, sweep_figure
from vibench.analysis.report._transmission import transmission_figure, transmission_levels_figure
from vibench.analysis.results.campaign_results import result_of
from vibench.analysis.tables import plus_minus

PNG_HEAD = b"\x89PNG\r\n\x1a\n"


def result(path, simulation=Simulation.UNDER_VOLTAGE):
    with open_recording(path) as recording:
        return result_of(recording, simulation)[0]


@pytest.fixture(scope="module")
def noise(noise_file):
    return result(noise_file())


@pytest.fixture(scope="module")
def sweep(sweep_file):
    return result(sweep_file)


@pytest.fixture(scope="module")
def weak(dwell_file):
    return result(dwell_file("weak"))


@pytest.fixture(scope="module")
def strong(dwell_file):
    return result(dwell_file("strong"))


def line(axes, label):
    return next(each for each in axes.get_lines() if each.get_label() == label)


def numbers(path):
    with path.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return {heading: np.array([float(row[heading] or "nan") for row in rows]) for heading in rows[0]}


@pytest.mark.thorough
def test_a_transmission_figure_shows_measurement_and_simulation(noise):
    drawn = transmission_figure(noise.analysis, noise.overlay)
    top, phase, strip, difference = drawn.figure.axes
    measured = line(top, "measured")
    np.testing.assert_array_equal(measured.get_ydata(), noise.analysis.response.frequency_response.magnitude)
    np.testing.assert_array_equal(
        measured.get_xdata(), noise.analysis.response.frequency_response.frequency_hz
    )
    simulated = line(top, "simulated from the recorded base motion")
    np.testing.assert_array_equal(simulated.get_ydata(), noise.overlay.response.frequency_response.magnitude)
    assert measured.get_color() != simulated.get_color() == SIMULATED
    assert difference.get_xlabel() == "frequency [Hz]"
    assert phase.get_ylabel() == "phase [°]"
    assert strip.get_ylabel() == "coherence"
    level = [each.get_ydata()[0] for each in strip.get_lines() if each.get_linestyle() == "-."]
    assert level == [noise.analysis.response.frequency_response.coherence_significance]
    assert top.get_legend() is None  # the legend is outside the axes and covers no data
    assert len(drawn.figure.legends) == 1


@pytest.mark.thorough
def test_a_transmission_caption_names_every_resonance_with_its_uncertainty(noise):
    caption = transmission_figure(noise.analysis, noise.overlay).caption
    for each in noise.analysis.response.resonances:
        assert f"{plus_minus(each.frequency_hz, 2 * each.sd_frequency_hz)} Hz" in caption
    assert f"{noise.overlay.difference.median_abs_db:.2g} dB" in caption


@pytest.mark.thorough
def test_files_saved_with_a_figure_contain_its_numbers(noise, tmp_path):
    png, svg, table, sines = transmission_figure(noise.analysis, noise.overlay).save(tmp_path / "figures")
    assert png.read_bytes().startswith(PNG_HEAD)
    assert ET.fromstring(svg.read_text(encoding="utf-8")).tag.endswith("svg")
    columns = numbers(table)
    frequency_response = noise.analysis.response.frequency_response
    np.testing.assert_allclose(columns["magnitude"], frequency_response.magnitude, rtol=1e-9)
    np.testing.assert_allclose(columns["magnitude_upper"], frequency_response.magnitude_upper, rtol=1e-9)
    assert numbers(sines)["response_i"].size == noise.overlay.prediction.frequency_hz.size


@pytest.mark.thorough
def test_drawing_the_same_figure_twice_gives_identical_files(noise):
    drawn = [transmission_figure(noise.analysis).svg for _ in range(2)]
    assert drawn[0] == drawn[1]


@pytest.mark.thorough
def test_noise_levels_are_drawn_from_weak_to_strong(noise, tmp_path):
    found = noise.analysis
    drawn = transmission_levels_figure([found, found])
    labels = [each.get_label() for each in drawn.figure.axes[0].get_lines()]
    assert sum("0.05 Vpp" in each for each in labels) == 2
    assert "at 2 noise levels" in drawn.caption


@pytest.mark.thorough
def test_a_sweep_figure_shades_the_measured_collision_region(sweep):
    drawn = sweep_figure(sweep.analysis, sweep.overlay)
    region = sweep.analysis.collisions.regions[0]
    shaded = drawn.figure.axes[1].patches[0]
    assert shaded.get_x() == pytest.approx(region.low_hz)
    assert shaded.get_x() + shaded.get_width() == pytest.approx(region.high_hz)
    measured = line(drawn.figure.axes[1], "measured response")
    np.testing.assert_array_equal(measured.get_ydata(), sweep.analysis.response.response_i)
    assert drawn.figure.axes[0].get_xlabel() == "time of the sweep [s]"
    # The stated range is the interval sweep, which need not be symmetric about its first point.
    lopsided = replace(
        region, start=replace(region.start, frequency_hz=257.0, lower_hz=254.0, upper_hz=278.0)
    )
    assert regions_text(replace(sweep.analysis.collisions, regions=(lopsided,))).startswith(
        "the masses collide from 266 ± 12 Hz"
    )
    (region,) = sweep.analysis.collisions.regions
    stop = replace(region.stop, lower_hz=285.0, upper_hz=289.0)
    ended = replace(sweep.analysis.collisions, regions=(replace(region, stop=stop, reaches_stop=False),))
    # The end of the collisions varies by chance, so its bounds are those of one run.
    assert regions_text(ended).endswith(" to 287.0 ± 2.0 Hz in this run")
    assert f"{sweep.overlay.run.impact_rate_hz:.0f} impacts per second" in drawn.caption


def test_frequencies_marked_above_a_sweep_are_within_its_range(sweep):
    figure = sweep_figure(sweep.analysis).figure
    (top,) = figure.axes[0].child_axes
    figure.draw_without_rendering()
    low, high = top.get_xlim()
    beyond = [each for each in top.xaxis.get_majorticklocs() if not low <= each <= high]
    places = top.transScale.transform([(each, 0.0) for each in (low - 10.0, *beyond, high + 10.0)])
    assert not np.isfinite(places[:, 0]).any(), f"{beyond} Hz are drawn at the ends of {low:g} to {high:g} Hz"


def test_the_report_sentence_of_a_sweep_states_the_sweep_rate_once(sweep):
    (finding,) = sweep_findings(replace(sweep, overlay=None))
    rate = abs(sweep.analysis.response.sweep_rate_hz_per_s)
    assert f" Hz at {rate:.3g} Hz/s: the masses collide from" in finding
    assert f"The frequency was swept at {rate:.3g} Hz/s." in sweep_figure(sweep.analysis).caption


def test_collisions_throughout_a_sweep_are_reported_in_one_phrase(sweep):
    found = sweep.analysis.collisions
    (region,) = found.regions
    whole = replace(region, reaches_start=True, reaches_stop=True)
    assert regions_text(replace(found, regions=(whole,))) == "the masses collide during the whole sweep"


@pytest.mark.thorough
def test_dwells_are_drawn_in_rows_by_level_and_the_caption_states_their_responses(strong, weak):
    drawn = dwells_figure([(each.analysis, each.overlay) for each in (strong, weak)])
    assert len(drawn.figure.axes) == 6
    assert drawn.figure.axes[0].get_ylabel().startswith("0.01 Vpp")
    spectrum = drawn.figure.axes[2].get_lines()[-2]
    np.testing.assert_array_equal(spectrum.get_ydata(), spectrum_columns(weak.analysis.response)[1])
    for each in (weak, strong):
        assert f"Response I {each.analysis.response.response_i:.3g}" in drawn.caption


def test_the_highest_bar_of_a_dwell_spectrum_is_response_ii(weak):
    found = weak.analysis.response
    frequency_hz, size = spectrum_columns(found)
    # A sine between two lines reads up to 15 % low with a Hann window.
    assert np.max(size) == pytest.approx(found.response_ii, rel=0.16)
    assert frequency_hz[np.argmax(size)] == pytest.approx(260.0, abs=1.0)


def test_a_stepped_sine_figure_has_one_marker_per_step(stepped_file):
    found = result(stepped_file)
    drawn = stepped_sine_figure(found.analysis, found.overlay, STEPPED_FREQUENCIES)
    measured = line(drawn.figure.axes[1], "measured, up")
    np.testing.assert_array_equal(measured.get_ydata(), found.analysis.response.response_ii)
    assert "2 steps" in drawn.caption


@pytest.mark.thorough
def test_more_parts_than_planned_are_attributed_to_feedback(strong):
    facts = strong.analysis.facts
    many = replace(facts, whole_stretches=78, planned_stretches=2)
    said = [{each.what: each.text for each in measurement_checks(one)}["Parts"] for one in (facts, many)]
    assert said[0] == "1 of 1 planned parts were recorded completely"
    assert said[1] == "78 parts were recorded completely; feedback determined their number"


@pytest.mark.thorough
def test_levels_of_all_channels_are_shown_with_units(strong):
    facts = strong.analysis.facts
    drawn = bench_levels_figure(facts)
    labels = [each.get_ylabel() for each in drawn.figure.axes]
    assert [label.split("[")[1] for label in labels] == ["mV]", "m/s²]", "mm/s]"]
    assert f"{100 * facts.channels[0].share_of_range:.2g} % of its range" in drawn.caption


@pytest.mark.parametrize(
    "plan",
    [
        Dwell(amplitude_vpp=2, frequency_hz=260, duration_s=1),
        SineSweep(amplitude_vpp=2, start_hz=150, stop_hz=350, duration_s=2),
        WhiteNoise(amplitude_vpp=2, band_start_hz=20, band_stop_hz=800),
        StreamedNoise(amplitude_vpp=2, band_start_hz=50, band_stop_hz=600, duration_s=2),
        SteppedSine(amplitude_vpp=2, frequencies_hz=(200, 210), record_s=0.5, settle_s=0.1),
    ],
    ids=lambda plan: plan.kind,
)
def test_every_excitation_can_be_drawn_before_output(plan):
    drawn = excitation_figure(Measurement(name="plan", excitation=plan))
    signal, spectrum = drawn.figure.axes
    assert signal.get_ylabel().startswith("planned voltage [")
    low, high = spectrum.get_xlim()
    assert low < plan.highest_frequency_hz < high
    assert "2 Vpp" in drawn.caption
    assert drawn.png.startswith(PNG_HEAD)


@pytest.mark.parametrize(
    ("largest", "expected"),
    [(5e-6, (1e6, "µm")), (0.02, (1e3, "mm")), (3.0, (1.0, "m")), (1e-12, (1e9, "nm"))],
)
def test_unit_prefixes_are_chosen_so_that_values_are_between_1_and_1000(largest, expected):
    factor, unit = with_prefix(largest, "m")
    assert factor == pytest.approx(expected[0])
    assert unit == expected[1]


def test_the_title_of_a_figure_of_frequency_steps_names_the_kind_of_excitation(stepped_file):
    found = result(stepped_file).analysis
    plan = SettledSine(amplitude_vpp=2, frequencies_hz=(200, 210), record_s=0.5)
    assert STEPPED_FREQUENCIES.title(plan, found.response).startswith("Settled sine, 2 Vpp")
    assert STEPPED_FREQUENCIES.title(found.excitation, found.response).startswith("Stepped sine")
    assert STEPPED_FREQUENCIES.caption(plan, found.response).startswith("Settled sine at 2 Vpp")
