"""Calls with random numbers of every native function that takes one structure."""

from dataclasses import replace

import numpy as np

from vibench.sim import Harmonic, gong2025
from vibench.sim.engine.run import cubic_tables, start_at
from vibench.sim.engine.scene import collision_structure, fill_cell, fill_drive, power_structure

LAWS = (
    "hertz",
    "hunt_crossley:0.5",
    "linear_gap",
    "rigid:0.8",
    "rigid:0",
    "linear",
    "power:5",
    "power:3+5+7",
)
STATES, STEPS, PARAMETERS = 8, 40, 2


def calls(engine, draws):
    """Yield the name, the structure and the output arrays of each function."""

    def normal(*shape, scale=1.0):
        return scale * draws.standard_normal(shape)

    def low_pass():
        pole = draws.uniform(0.1, 0.9)
        weights = {"numerator": np.array([1.0 - pole, 0.0]), "denominator": np.array([1.0, -pole])}
        return engine.new("RecursiveFilter", state=np.zeros(2), **weights)

    def sensor(steps):
        volts, instead = np.zeros(steps), np.full(steps, np.nan)
        instead[::7] = 0.5
        motion, noise = normal(steps), normal(steps, scale=0.01)
        arrays = {"motion": motion, "noise": noise, "instead": instead, "volts": volts}
        return engine.new(
            "Sensor", filter=low_pass(), full_scale=2.0, full_scale_voltage=5.0, **arrays
        ), volts

    values = np.zeros((2, 30))
    positions, table = draws.uniform(-40.0, 140.0, 30), normal(19, 64)
    arrays = {"samples": normal(2, 100), "positions": positions, "table": table, "values": values}
    yield "interpolate", engine.new("Interpolation", channels=2, **arrays), [values]

    samples = np.zeros(12)
    for rows, ratio in ((1, 3.0), (5, draws.uniform(0.3, 5.0))):
        arrays = {"means": normal(100), "table": normal(rows, 24), "samples": samples}
        place = {
            "ratio": ratio,
            "begin": draws.uniform(0.0, 5.0),
            "first": 1000,
            "origin": -int(1001 * ratio),
        }
        yield "decimate", engine.new("Decimation", reach=24, **place, **arrays), [samples]

    powers, counts = np.zeros((289, 6)), np.zeros(6)
    yield "describe_collisions", engine.new("CollisionMonomials", powers=powers, counts=counts), [powers]

    result = np.zeros(50)
    arrays = {"values": normal(50), "result": result}
    yield "filter_signal", engine.new("FilteredSignal", filter=low_pass(), **arrays), [result]

    structure, volts = sensor(STEPS)
    yield "show", structure, [volts]

    controller = engine.new("Controller", is_on=1, harmonics=3, remembered=2, fade=1.0, limit=1.0)
    controller["omega_to"], controller["glide_step"] = 0.3, 0.4
    controller["block"], controller["turns"] = 10.0, 1.5
    controller["reference"][:, :3] = normal(2, 3) + 1j * normal(2, 3)
    controller["step"][:2, :2], controller["inlet"][:2] = normal(2, 2, scale=0.3), normal(2, 2)
    (base, _), (m0, volts) = sensor(STEPS), sensor(STEPS)
    drive, late = normal(STEPS), normal(7)
    loop = engine.new(
        "LoopCables", controller=controller.ctypes.data, base=base, m0=m0, drive=drive, late=late
    )
    loop.lent["controller"] = controller
    loop["steps_per_sample"], loop["first"] = 4, 8
    filled = [drive, late, controller["sums"].real]
    yield "play_loop", loop, filled
    yield "hear_loop", loop, [*filled, volts]
    yield "play_loop", loop, filled
    shaker, moved = shaker_of(engine, draws, drive)
    yield "move_shaker", shaker, moved
    engine.fill(loop, shaker=shaker.ctypes.data, begin=0)
    loop.lent["shaker"] = shaker
    yield "close_loop", loop, [*filled, *moved]

    yield from motion_calls(engine, draws, normal)
    yield from chain_calls(engine, normal)


def shaker_of(engine, draws, drive):
    """Return a shaker with a specimen at or near contact, and its output arrays."""
    specimen = gong2025(contact=str(draws.choice(LAWS)))
    tables, state = cubic_tables(engine, specimen, 1e-5), engine.new("State")
    start_at(engine, tables, specimen, state, [2e-5, 4.4e-5, 0.0, 0.0, draws.uniform(-0.5, 0.5), 0.0], 3e-7)
    moved = {name: np.zeros(STEPS) for name in ("amplifier_voltage", "base_acceleration", "m0_velocity")}
    moved["ends"], moved["begun"] = np.zeros((STEPS // 2, 9)), np.zeros(4)
    lags = {"low_decay": 0.99, "low_mean": 0.995, "high_decay": 0.3, "high_mean": 0.6}
    limits = {"gain": 3.0, "clip": 2.5, "current_limit": 3.0, "stroke": 1e-5}
    stops = {
        "stop_stiffness": 1e5,
        "stop_damping": 10.0,
        "tolerance": 3e-7,
        "step": 1e-5,
        "block": STEPS // 4,
    }
    arrays = {"tables": tables, "drive": drive, "noise": np.zeros(STEPS), **moved}
    shaker = engine.new("LoadedShaker", specimen=state, **lags, **limits, **stops, **arrays)
    shaker["transition"] = np.eye(3, 5)
    shaker["transition"][0, 1], shaker["transition"][1, 4] = 1e-5, 8e-5
    shaker["transition"][1:, 3] = 0.01, 0.1
    # Within a few steps there may be no contact, so the contact count may be 0.
    return shaker, [array for name, array in moved.items() if name != "begun"]


def motion_calls(engine, draws, normal):
    """Yield calls that filter, smooth and follow a motion with contacts in most steps."""
    stop = np.array([1e-5, 2e-5, 4.9e9, 1.5, 0.0, 0.3, 476.0, 500.0])
    if draws.random() < 0.5:
        stop[2:5] = 1e8, 1.3, 1e4
    noise = normal(STATES, STATES, scale=1e-6)

    def varied(*shape):
        flows = np.zeros((*shape, STATES, STATES + 2))
        flows[..., :STATES] = np.eye(STATES)
        return flows + normal(*flows.shape, scale=1e-6)

    for parameters in (0, PARAMETERS):
        states = STATES + parameters
        state, covariance, grown = (
            normal(states, scale=1e-5),
            np.eye(states) * 1e-6,
            np.zeros((states, states)),
        )
        state[3:6] = normal(3, scale=0.3)
        grown[:STATES, :STATES] = noise @ noise.T
        # Samples are stored only without parameters.
        shapes = {"states": (8,), "covariances": (8, 8), "jacobians": (8, 8), "innovations": (2,)}
        shapes = {} if parameters else shapes | {"kinds": (), "impulses": ()}
        kept = {name: np.zeros((STEPS, *shape)) for name, shape in shapes.items()}
        record = engine.new("TrackRecord", **kept)
        numbers = {"step": 2e-5, "small_steps": 7, "velocity_variance": 1e-6, "impulse_share": 0.01}
        level = {"level": 1.0, "level_share": 0.01, "limit": 1e9}
        arrays = {
            "acceleration": normal(STEPS + 1, scale=20.0),
            "velocity": np.where(draws.random(STEPS) < 0.1, np.nan, normal(STEPS, scale=0.05)),
            "flows": varied(1 + parameters),
            "small_flows": varied(1 + parameters),
            "stops": np.tile(stop, (1 + parameters, 1)) * draws.uniform(0.999, 1.001, (1 + parameters, 8)),
            "deviations": np.full(parameters, 1e-3),
            "noise": grown,
            "force_variance": draws.uniform(0.0, 1.0, STEPS),
            "force_input": normal(STATES, scale=1e-3),
            "state": state,
            "covariance": covariance,
        }
        work = engine.new("MotionFilter", record=record, **numbers, **level, **arrays)
        yield "filter_motion", work, [state, covariance, *kept.values()]
        if parameters:
            return

        kept["kinds"][:] = draws.integers(0, 3, STEPS)
        kept["covariances"][:], kept["jacobians"][:] = grown, normal(STEPS, 8, 8, scale=0.3)
        kept["states"][:], kept["innovations"][:] = normal(STEPS, 8), np.abs(normal(STEPS, 2))
        filled = {"states": np.zeros((STEPS, 8)), "variances": np.zeros((STEPS, 2))}
        filled |= {"forces": np.zeros((STEPS, 2)), "matrix": np.zeros((8, 8))}
        given = {name: arrays[name] for name in ("force_variance", "force_input")}
        work = engine.new("MotionSmoother", record=record, flow=varied(), **given, **filled)
        yield "smooth_motion", work, list(filled.values())

        states, contacts = normal(STEPS, 8, scale=5e-6), np.zeros((STEPS, 7))
        states[:, 3:6] = normal(STEPS, 3, scale=0.3)
        arrays = {"states": states, "touched": np.ones(STEPS), "acceleration": normal(STEPS + 20, scale=20.0)}
        arrays |= {"small_flow": free_flow(2e-5 / 7), "stop": stop, "contacts": contacts}
        work = engine.new("ContactSearch", step=2e-5, small_steps=7, longest=50, **arrays)
        yield "follow_contacts", work, [contacts]


def chain_calls(engine, normal):
    """Yield calls for a chain with every contact law, driven by a sine and by a piecewise force."""
    laws = ("hertz", "power:3+5", "hunt_crossley:0.5", "linear_gap", "linear", "hertz")
    cells, kinds = len(laws) + 4, engine.rows("CellKind", len(laws))
    for kind, law in zip(kinds, laws, strict=True):
        link = (gong2025().stiffnesses[0], gong2025().dampings[0])
        fill_cell(kind, replace(gong2025(contact=law), lower_gap_m=30e-6), *link)
    for pieces in (np.zeros((0, 8)), normal(20, 8) * 2000.0 ** np.arange(8)):
        states = engine.rows("CellState", cells)
        for name in ("p", "x", "z"):
            states[name], states[f"v{name}"] = normal(cells, scale=2e-5), normal(cells, scale=0.1)
        filled = {
            "states": states.view(np.float64),
            "samples": np.zeros((30, cells, 6)),
            "impact_times": np.zeros(300),
            "impact_cells": np.zeros(300),
            "peaks": np.zeros((cells, 2)),
            "lines": np.zeros((cells, 2)),
        }
        numbers = {"until": 0.01, "tolerance": 3e-7, "fastest": 5000.0, "windows_left": 1000, "watch": 2}
        chain = engine.new(
            "ChainMotion",
            kinds=kinds.view(np.float64),
            kind_of=np.arange(cells) % len(laws) * 1.0,
            windows=np.array([8e-5, 4e-5]),
            clashes=np.array([1.0, 0.0]),
            pieces=pieces,
            piece_length=5e-4,
            collisions=collision_structure(engine).ctypes.data,
            power_shapes=power_structure(engine).ctypes.data,
            sample_rate=2e3,
            memory=np.zeros(engine.chain_memory(cells, len(laws))),
            **numbers,
            **filled,
        )
        fill_drive(chain["drive"], Harmonic(220.0, 2e-5), gong2025())
        yield "start_chain", chain, [filled["states"]]
        yield "follow_chain", chain, list(filled.values())


def free_flow(step):
    """Return the flow over a step of free masses that only the base acceleration moves."""
    flow = np.eye(STATES, STATES + 2)
    flow[[0, 1, 2], [3, 4, 5]] = step
    flow[3:6, STATES] = -step
    return flow
