"""Random scenes (specimen and drive): models, damping times, gaps, frequencies and amplitudes."""

from dataclasses import replace

import numpy as np

from vibench.sim import (
    AutomaticDuration,
    BranchEvent,
    Given,
    Harmonic,
    MotionKind,
    Parameter,
    Rest,
    Scene,
    gong2025,
    periodic_branch,
    solve_scene,
)
from vibench.sim.branches import MotionSearch, periodic_motions

MODELS = ("hertz", "linear_gap", "power:3", "power:5", "power:7")
EDGE = 0.004
"""Largest distance of a scene from the edge of chaos, relative to its frequency."""
STEP = 0.06
"""Distance within which an edge of chaos is searched for, relative to the frequency."""


def random_scene(random: np.random.Generator) -> Scene:
    """Return a random scene: 20 to 700 Hz, 0.2 to 200 um, gaps of 5 to 100 um, half of them unequal."""
    model = str(random.choice(MODELS))
    gap_m = float(random.uniform(5e-6, 100e-6))
    gaps_m = (gap_m, float(random.uniform(5e-6, 100e-6))) if random.random() < 0.5 else gap_m
    if model.startswith("power"):
        gaps_m = gap_m
    damping_time_s = float(random.uniform(0.0, 5e-5))
    drive = Harmonic(float(random.uniform(20.0, 700.0)), float(10 ** random.uniform(-6.7, -3.7)))
    return Scene(gong2025(damping_time_s, gaps_m, model), drive, duration=AutomaticDuration())


def edge_scene(random: np.random.Generator) -> Scene:
    """Return a random scene with chaos, next to a frequency at which the motion is not chaotic."""
    while True:
        scene = random_scene(random)
        outside = at(scene, scene.drive.frequency_hz * (1.0 + STEP * float(random.choice([-1.0, 1.0]))))
        if not is_chaotic(scene) or is_chaotic(outside):
            continue
        inner_hz, outer_hz = scene.drive.frequency_hz, outside.drive.frequency_hz
        while abs(outer_hz / inner_hz - 1.0) > EDGE:
            middle_hz = 0.5 * (inner_hz + outer_hz)
            if is_chaotic(at(scene, middle_hz)):
                inner_hz = middle_hz
            else:
                outer_hz = middle_hz
        return at(scene, inner_hz)


def quasi_periodic_scene(random: np.random.Generator) -> Scene:
    """Return a random scene of the paper's specimen that is quasi-periodic or undecided."""
    while True:
        drive = Harmonic(float(random.uniform(100.0, 140.0)), float(random.uniform(8e-6, 40e-6)))
        specimen = gong2025(float(random.uniform(2e-5, 5e-5)))
        scene = Scene(specimen, drive, duration=AutomaticDuration())
        found = solve_scene(replace(scene, budget_s=0.0))
        if found.motion in {MotionKind.QUASI_PERIODIC, MotionKind.UNDECIDED}:
            return scene


FEW = MotionSearch(places=2, starts=2)
"""Small search for a motion whose branch has a bifurcation."""


def near_bifurcation(random: np.random.Generator) -> tuple[BranchEvent, Scene]:
    """Return a random bifurcation, and a scene near it that starts from rest or near its motion.

    The relative distance of the frequency is 1e-6 to 1e-3, that of the initial state 1e-6 to 1e-1.
    """
    while True:
        scene = random_scene(random)
        drive = scene.drive
        orbit = next(periodic_motions(scene.specimen, drive, FEW), None)
        if orbit is None:
            continue
        stop_hz = drive.frequency_hz * float(random.choice([0.7, 1.3]))
        events = periodic_branch(orbit, Parameter.FREQUENCY, stop_hz).events
        kinds = sorted({each.kind for each in events})
        if not kinds:
            continue
        kind = random.choice(kinds)
        same = [each for each in events if each.kind == kind]
        event = same[int(random.integers(len(same)))]
        away = float(random.choice([-1.0, 1.0]) * 10 ** random.uniform(-6.0, -3.0))
        size = 10 ** random.uniform(-6.0, -1.0) * np.abs(event.state)
        state = event.state + size * random.standard_normal(6)
        start = Rest() if random.random() < 0.3 else Given(tuple(map(float, state)))
        return event, replace(at(scene, event.frequency_hz * (1.0 + away)), start=start)


def at(scene: Scene, frequency_hz: float) -> Scene:
    """Return the scene at another frequency."""
    return replace(scene, drive=Harmonic(frequency_hz, scene.drive.amplitude_m))


def is_chaotic(scene: Scene) -> bool:
    """Return whether the motion of a scene is chaotic."""
    found = solve_scene(replace(scene, budget_s=0.0))
    return found.motion in {MotionKind.CHAOTIC, MotionKind.CHAOTIC_SO_FAR}


def scene_line(scene: Scene) -> str:
    """Return the parameters of a scene as one line."""
    specimen, drive = scene.specimen, scene.drive
    gaps = "/".join(f"{1e6 * gap_m:.4g}" for gap_m in dict.fromkeys(specimen.gaps_m))
    damping_s = specimen.dampings[0] / specimen.stiffnesses[0]
    driven = f"{drive.frequency_hz:.5g} Hz {1e6 * drive.amplitude_m:.4g} um"
    return f"{specimen.contact.kind} {driven}, gap {gaps} um, {damping_s:.3g} s"
