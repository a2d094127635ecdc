"""The rig model without specimen against closed forms; see also tests/sim/shaker/test_linear_motion.py."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from tests.changed import changed
from vibench.acquisition.rig import BaseQuantity, OnTable, RigModel, load_rig, shaker_of, suspended_mass_kg

RIG = load_rig("virtual_rig")
MODEL = RigModel(RIG, OnTable.NOTHING)


def with_amplifier(**changes):
    return RigModel(changed(RIG, amplifier=changes), OnTable.NOTHING)


def with_shaker(**changes):
    return RigModel(changed(RIG, shaker=changes), OnTable.NOTHING)


def test_a_constant_voltage_through_a_direct_coupled_amplifier_deflects_the_table_statically():
    model = with_amplifier(low_cut_hz=0.0)
    shaker, gain = RIG.shaker, RIG.amplifier.gain
    current = gain / shaker.coil_resistance_ohm
    deflection = shaker.force_constant_n_per_a * current / shaker.suspension_stiffness_n_per_m
    assert model.transfer(BaseQuantity.CURRENT, 0.0) == pytest.approx(current)
    assert model.transfer(BaseQuantity.STROKE, 0.0) == pytest.approx(deflection)
    assert model.transfer(BaseQuantity.VELOCITY, 0.0) == 0


def test_an_amplifier_with_a_lower_band_edge_blocks_dc():
    model = with_amplifier(low_cut_hz=0.3)
    assert model.transfer(BaseQuantity.AMPLIFIER_VOLTAGE, 0.0) == 0


def test_the_amplifier_gain_is_3_db_down_at_its_band_edges():
    model = with_amplifier(low_cut_hz=0.3, high_cut_hz=30e3)
    edges = np.abs(model.transfer(BaseQuantity.AMPLIFIER_VOLTAGE, [0.3, 30e3]))
    assert edges == pytest.approx(RIG.amplifier.gain / np.sqrt(2), rel=1e-4)
    middle = abs(model.transfer(BaseQuantity.AMPLIFIER_VOLTAGE, 95.0))
    assert middle == pytest.approx(RIG.amplifier.gain, rel=1e-4)


def test_the_ratio_of_force_to_acceleration_tends_to_the_suspended_mass_at_high_frequency():
    frequency_hz = 5000.0
    force = MODEL.transfer(BaseQuantity.FORCE, frequency_hz)
    acceleration = MODEL.transfer(BaseQuantity.ACCELERATION, frequency_hz)
    assert abs(force / acceleration) == pytest.approx(suspended_mass_kg(RIG.shaker), rel=1e-3)


def test_the_undamped_table_resonates_at_sqrt_of_stiffness_over_mass():
    shaker = RIG.shaker
    resonance_hz = np.sqrt(shaker.suspension_stiffness_n_per_m / suspended_mass_kg(shaker)) / (2 * np.pi)
    model = with_shaker(force_constant_n_per_a=1e-6, suspension_damping_ns_per_m=0.1)
    frequency_hz = np.linspace(0.8, 1.2, 4001) * resonance_hz
    stroke = np.abs(model.transfer(BaseQuantity.STROKE, frequency_hz))
    assert frequency_hz[np.argmax(stroke)] == pytest.approx(resonance_hz, rel=2e-4)


def test_the_moving_coil_damps_the_table_by_its_back_emf():
    shaker = RIG.shaker
    resonance_hz = np.sqrt(shaker.suspension_stiffness_n_per_m / suspended_mass_kg(shaker)) / (2 * np.pi)
    model = with_shaker(coil_inductance_h=1e-12)
    velocity = abs(model.transfer(BaseQuantity.VELOCITY, resonance_hz))
    voltage = abs(model.transfer(BaseQuantity.AMPLIFIER_VOLTAGE, resonance_hz))
    force_constant, resistance = shaker.force_constant_n_per_a, shaker.coil_resistance_ohm
    damping = shaker.suspension_damping_ns_per_m + force_constant**2 / resistance
    assert velocity == pytest.approx(voltage * force_constant / resistance / damping, rel=1e-6)


@given(st.floats(0.5, 20e3))
def test_velocity_and_acceleration_are_derivatives_of_the_stroke(frequency_hz):
    s = 2j * np.pi * frequency_hz
    stroke = complex(MODEL.transfer(BaseQuantity.STROKE, frequency_hz))
    assert complex(MODEL.transfer(BaseQuantity.VELOCITY, frequency_hz)) == pytest.approx(s * stroke)
    assert complex(MODEL.transfer(BaseQuantity.ACCELERATION, frequency_hz)) == pytest.approx(s**2 * stroke)


@given(st.floats(0.5, 20e3))
def test_the_state_equations_of_the_rig_agree_with_its_transfer_functions(frequency_hz):
    equations = shaker_of(RIG).equations()
    s = 2j * np.pi * frequency_hz
    voltage = complex(MODEL.transfer(BaseQuantity.AMPLIFIER_VOLTAGE, frequency_hz))
    state = np.linalg.solve(s * np.eye(3) - equations.A, equations.B[:, 0]) * voltage
    expected = [
        MODEL.transfer(q, frequency_hz)
        for q in (BaseQuantity.STROKE, BaseQuantity.VELOCITY, BaseQuantity.CURRENT)
    ]
    assert state == pytest.approx(np.array(expected), rel=1e-9)


@given(st.floats(1.0, 5e3))
def test_the_electrical_power_equals_the_sum_of_heat_and_friction(frequency_hz):
    # Mean power of a sine from peak phasors; without specimen no other power is used.
    shaker = RIG.shaker
    voltage, current, velocity = (
        complex(MODEL.transfer(q, frequency_hz))
        for q in (BaseQuantity.AMPLIFIER_VOLTAGE, BaseQuantity.CURRENT, BaseQuantity.VELOCITY)
    )
    delivered = 0.5 * (voltage * current.conjugate()).real
    heat = 0.5 * shaker.coil_resistance_ohm * abs(current) ** 2
    friction = 0.5 * shaker.suspension_damping_ns_per_m * abs(velocity) ** 2
    assert delivered == pytest.approx(heat + friction, rel=1e-9)


def test_results_for_an_array_of_frequencies_have_the_shape_of_the_array():
    frequency_hz = np.geomspace(1, 1000, 12).reshape(3, 4)
    for quantity in BaseQuantity:
        assert MODEL.transfer(quantity, frequency_hz).shape == (3, 4)
