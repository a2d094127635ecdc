"""The public API of the simulation accepts enums as text and has the documented types."""

import inspect
import typing
from enum import StrEnum

import numpy as np
import pytest

import vibench.sim as sim
import vibench.sim.chain as chain
import vibench.sim.maps as maps
import vibench.sim.study as study

SPECIMEN, DRIVE = sim.gong2025(), sim.Harmonic(130.0, 20e-6)
SMOOTH = sim.gong2025(contact="linear")
SHORT = {"duration_s": 0.05, "window_s": 0.02}
SAMPLES = sim.Sampled(np.zeros(8), 1e4)

SMALL_MAP = maps.Map(frequency_hz=maps.Range(start=90.0, stop=91.0, points=2), amplitude_m=1e-6)
ONE_POINT = study.Study(models=["linear"], frequencies_hz=[90.0], amplitudes_m=[1e-6])


def orbit():
    return sim.periodic_orbit(SMOOTH, DRIVE, start=np.zeros(6))


CALLS = {
    sim.integrate: lambda **words: sim.integrate(SPECIMEN, DRIVE, 0.01, **words),
    sim.follow_samples: lambda **words: sim.follow_samples(SPECIMEN, SAMPLES, **words),
    sim.steady_response: lambda **words: sim.steady_response(SPECIMEN, DRIVE, **SHORT, **words),
    sim.lyapunov_exponent: lambda **words: sim.lyapunov_exponent(
        SPECIMEN, DRIVE, duration_s=1.0, settle_s=0.1, **words
    ),
    sim.lyapunov_spectrum: lambda **words: sim.lyapunov_spectrum(
        SPECIMEN, DRIVE, duration_s=1.0, settle_s=0.1, **words
    ),
    sim.periodic_orbit: lambda **words: sim.periodic_orbit(SMOOTH, DRIVE, start=np.zeros(6), **words),
    sim.periodic_branch: lambda **words: sim.periodic_branch(orbit(), stop=130.01, **words),
    sim.phase_resonance_branch: lambda **words: sim.phase_resonance_branch(
        SMOOTH, (490.0, 510.0), (1e-8, 1.1e-8), **words
    ),
    chain.integrate_chain: lambda **words: chain.integrate_chain(
        chain.chain_of(SPECIMEN, 2), DRIVE, 0.01, **words
    ),
    chain.chain_response: lambda **words: chain.chain_response(
        chain.chain_of(SPECIMEN, 2), DRIVE, **SHORT, **words
    ),
    chain.chain_lyapunov_exponent: lambda **words: chain.chain_lyapunov_exponent(
        chain.chain_of(SPECIMEN, 2), DRIVE, duration_s=0.5, settle_s=0.01, **words
    ),
    study.solve_study: lambda **words: study.solve_study(ONE_POINT, **words),
    study.store_of: lambda **words: study.store_of(ONE_POINT, None, **words).__enter__(),
    maps.solve_map: lambda **words: maps.solve_map(SMALL_MAP, **words),
    study.prediction_at: lambda **words: study.prediction_at(
        study.solve_study(ONE_POINT).arrays, 0, 90.0, 1e-6, start="rest", **words
    ),
    sim.Scene: lambda **words: sim.Scene(SPECIMEN, DRIVE, **words),
    sim.solve_scene: lambda **words: sim.solve_scene(
        sim.Scene(SPECIMEN, DRIVE, duration=sim.FixedDuration(0.2, 0.1)), **words
    ),
    sim.BalanceOptions: sim.BalanceOptions,
}
"""A call of each public function that takes an enum."""


def enum_in(annotation):
    """Return the enum in a type annotation, or None."""
    parts = typing.get_args(annotation) or (annotation,)
    return next((part for part in parts if isinstance(part, type) and issubclass(part, StrEnum)), None)


def enum_parameters():
    for face in (sim, study, maps, chain):
        for name in face.__all__:
            function = getattr(face, name)
            if inspect.isfunction(function):
                for parameter, annotation in typing.get_type_hints(function).items():
                    kind = enum_in(annotation)
                    if kind is not None and parameter != "return":
                        yield pytest.param(function, parameter, kind, id=f"{name}-{parameter}")
    yield pytest.param(sim.Scene, "accuracy", sim.Accuracy, id="Scene-accuracy")
    yield pytest.param(sim.BalanceOptions, "kept", sim.HarmonicSet, id="BalanceOptions-kept")


@pytest.mark.parametrize(("function", "parameter", "kind"), list(enum_parameters()))
def test_enum_arguments_accept_their_values_as_text_and_refuse_other_texts(function, parameter, kind):
    call = CALLS[function]
    call(**{parameter: next(iter(kind)).value})
    with pytest.raises(ValueError, match=f"'nonsense' is not allowed: give one of {', '.join(kind)}"):
        call(**{parameter: "nonsense"})


def test_observables_and_accuracy_may_be_given_as_text():
    named = sim.Scene(SPECIMEN, DRIVE, observe=("response", "lyapunov"), accuracy="quick")
    assert named.observe == (sim.Observable.RESPONSE, sim.Observable.LYAPUNOV)
    assert named.accuracy is sim.Accuracy.QUICK
    assert study.Study(
        frequencies_hz=[90.0], amplitudes_m=[1e-6], accuracy="quick", starts=["up"]
    ).starts == (study.Start.UP,)


def test_type_hints_list_every_value_of_an_enum_that_may_be_given_as_text():
    for case in enum_parameters():
        function, parameter, kind = case.values
        if inspect.isfunction(function):
            literals = [
                word
                for part in typing.get_args(typing.get_type_hints(function)[parameter])
                if typing.get_origin(part) is typing.Literal
                for word in typing.get_args(part)
            ]
            assert literals == list(kind), case.id
