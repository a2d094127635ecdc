"""Call the C interface with broken structures; it must return an error code and never crash.

python tests/sim/engine/fuzz_interface.py LIBRARY [--count N] [--seed N]
"""

import argparse
from pathlib import Path

import numpy as np
from native_calls import calls

from vibench.sim import Harmonic, gong2025
from vibench.sim.engine.batch import collision_fit
from vibench.sim.engine.library import Engine, EngineError
from vibench.sim.engine.scene import collision_structure, fill_power, fill_specimen, power_structure, scene_of

STRANGE = [np.nan, np.inf, -np.inf, 0.0, -0.0, -1.0, 1.0, 1e-320, 1e300, -1e300, 1e18, 3.5]
STRANGE_COUNTS = [-(2**63), -1, 0, 1, 2, 3, 6, 7, 2**31, 2**62]
POINTERS = {
    *("collisions", "power_shapes", "samples", "impact_times"),
    *("growth", "impacts", "motions", "controller", "shaker", "at", "tables", "now", "sections", "fit"),
    "record",
}
LAWS = ("hertz", "hunt_crossley:0.5", "linear_gap", "rigid:0.8", "linear", "power:5", "power:3+5+7")
CODES = {-1, 0, 1, 2, 3, 4}


def corrupt(structure, draws):
    """Overwrite one number of a structure or of a nested structure."""
    names = [name for name in structure.dtype.names if name not in POINTERS]
    name = draws.choice(names)
    kind = structure.dtype[name]
    if kind.names:
        corrupt(structure[name], draws)
    elif kind.base == np.int64:
        structure[name] = draws.choice(STRANGE_COUNTS)
    elif kind.shape:
        structure[name][tuple(draws.integers(size) for size in kind.shape)] = draws.choice(STRANGE)
    else:
        structure[name] = draws.choice(STRANGE)


def call(engine, draws):
    """Run one scene with possibly broken structures and return its code."""
    specimen = gong2025(contact=str(draws.choice(LAWS)))
    scene = scene_of(engine, specimen, Harmonic(draws.uniform(50.0, 500.0), 2e-5))
    # A corrupted contact law may need either table.
    scene["collisions"] = collision_structure(engine).ctypes.data
    scene["power_shapes"] = power_structure(engine).ctypes.data
    state, record = engine.new("State"), engine.new("Record")
    samples, times = np.zeros((50, 6)), np.zeros(40)
    record["sample_rate"], record["samples"] = 1e4, samples.ctypes.data
    record["sample_room"], record["impact_times"] = len(samples), times.ctypes.data
    record["impact_room"], record["steps_left"] = len(times), 100_000
    until, tolerance = 0.02, 3e-7
    # Only the array lengths ("rooms") must stay correct.
    rooms = int(record["sample_room"]), int(record["impact_room"])
    for part in draws.choice(["scene", "state", "record", "until", "tolerance"], draws.integers(1, 4)):
        if part == "until":
            until = float(draws.choice(STRANGE))
        elif part == "tolerance":
            tolerance = float(draws.choice(STRANGE))
        else:
            corrupt({"scene": scene, "state": state, "record": record}[part], draws)
    record["sample_room"] = min(int(record["sample_room"]), rooms[0])
    record["impact_room"] = min(int(record["impact_room"]), rooms[1])
    record["steps_left"] = min(int(record["steps_left"]), 100_000) if record["steps_left"] <= 2e9 else -1
    try:
        tables = engine.prepare(scene)
    except ValueError:
        return -1
    if draws.random() < 0.5:
        engine.start(tables, state, tolerance)
    kind = draws.integers(4)
    if kind == 3:
        return follow(engine, tables, state, tolerance, draws)
    if kind == 0:
        return engine.run(tables, state, until, tolerance, record)
    tangent, readings = engine.new("Tangent"), engine.new("Readings")
    tangent["changes"], tangent["rows"] = draws.integers(1, 7), np.eye(6)
    growth, impacts, motions = np.zeros(6 * 8), np.zeros(8, np.int64), np.zeros((8, 6))
    readings["interval"], readings["parts"], readings["room"] = 0.002, 2, 8
    readings["metric"], readings["growth"] = np.eye(6), growth.ctypes.data
    readings["impacts"], readings["motions"] = impacts.ctypes.data, motions.ctypes.data
    if draws.random() < 0.5:
        corrupt((tangent, readings)[draws.integers(2)], draws)
    readings["room"] = min(int(readings["room"]), 8)
    if kind == 1:
        return engine.run(tables, state, until, tolerance, record, tangent)
    last = int(draws.choice([-1, 0, 3, 8, 9]))
    return engine.take_readings(tables, state, tolerance, record, tangent, readings, last)


def call_on_cubics(engine, draws):
    """Run a scene with a cubic base motion and possibly broken structures; return its code."""
    specimen = gong2025(contact=str(draws.choice(LAWS)))
    scene = engine.new("CubicScene", interval=draws.choice([1e-5, 3e-4]), fastest=4e3)
    fill_specimen(scene["specimen"], specimen)
    fill_power(engine, scene, gong2025(contact="power:3+5+7").contact)
    base, motions, impacts = 1e-5 * draws.standard_normal((20, 4)), np.zeros((20, 6)), np.zeros(20)
    base[:, 1:] = draws.choice([0.0, 0.2]), 0.0, 0.0
    drive = engine.new(
        "CubicDrive", base=base, motions=motions, impacts=impacts, last_to=float(scene["interval"])
    )
    state, record, samples, times = engine.new("State"), engine.new("Record"), np.zeros((9, 6)), np.zeros(4)
    record["sample_rate"], record["samples"], record["sample_room"] = 2e4, samples.ctypes.data, len(samples)
    record["impact_times"], record["impact_room"], record["steps_left"] = (
        times.ctypes.data,
        len(times),
        10_000,
    )
    sizes = [(view, int(view)) for view in size_views(drive)]
    tolerance = float(draws.choice([3e-7, 3e-7, *STRANGE]))
    for structure in draws.choice([0, 1, 2, 3], draws.integers(4)):
        corrupt((scene, drive, state, record)[structure], draws)
    for view, true in sizes:
        view[...] = min(int(view), true)
    record["sample_room"] = min(int(record["sample_room"]), len(samples))
    record["impact_room"] = min(int(record["impact_room"]), len(times))
    record["steps_left"] = min(int(record["steps_left"]), 10_000)
    try:
        tables = engine.prepare_cubics(scene)
    except ValueError:
        return -1
    if draws.random() < 0.8:
        engine.start(tables, state, tolerance)
    return engine.run_cubics(tables, state, drive, tolerance, record)


def follow(engine, tables, state, tolerance, draws):
    """Follow nine motions in a batch with possibly broken structures; return its code."""
    states, sections, room = [state.copy() for _ in range(9)], np.zeros((9, 3, 6)), 3
    motions, fit = engine.rows("BatchMotion", 9), collision_fit(engine, gong2025()).copy()
    motions["tables"], motions["periods"] = tables.ctypes.data, draws.integers(1, room + 1, 9)
    for motion, own, kept in zip(motions, states, sections, strict=True):
        motion["now"], motion["sections"] = own.ctypes.data, kept.ctypes.data
    records = engine.rows("Record", 9)
    records["watch"] = draws.integers(3, size=9)
    motions["record"] = np.where(
        draws.random(9) < 0.7, records.ctypes.data + records.strides[0] * np.arange(9), 0
    )
    tangents = engine.rows("Tangent", 9)
    tangents["changes"], tangents["rows"] = 1, draws.standard_normal((9, 6, 6))
    growth, struck = np.zeros((9, room)), np.zeros((9, room), np.int64)
    carried = draws.random(9) < 0.5
    for name, own in (("tangent", tangents), ("growth", growth), ("struck", struck)):
        motions[name] = np.where(carried, own.ctypes.data + own.strides[0] * np.arange(9), 0)
    batch = engine.new("Batch", count=9, tolerance=tolerance)
    batch["motions"], batch["fit"] = motions.ctypes.data, fit.ctypes.data
    for _ in range(draws.integers(3)):
        broken = (batch, fit, motions[4], states[draws.integers(9)], records[draws.integers(9)], tangents[4])
        corrupt(broken[draws.integers(6)], draws)
    batch["count"] = min(int(batch["count"]), 9)
    motions["periods"] = np.minimum(motions["periods"], room)
    try:
        return engine.call("follow_batch", batch)
    except ValueError:
        return -1


def size_views(structure):
    """Yield views of the sizes of all arrays that a structure refers to."""
    for name in structure.dtype.names:
        if structure.dtype[name].names == ("at", "size"):
            yield structure[name]["size"]
        elif structure.dtype[name].names:
            yield from size_views(structure[name])


def call_corrupted(engine, draws):
    """Call every function with a possibly broken structure; yield the codes."""
    for function, structure, _ in calls(engine, draws):
        sizes = [(view, int(view)) for view in size_views(structure)]
        for _ in range(draws.integers(3)):
            corrupt(structure, draws)
        if function == "close_loop":
            sizes += [(view, int(view)) for view in size_views(structure.lent["shaker"])]
            corrupt(structure.lent["shaker"], draws)
        if function.endswith("_loop") and draws.random() < 0.3:
            corrupt(structure.lent["controller"], draws)
        if function.endswith("_chain"):
            if draws.random() < 0.3:
                lent = structure.lent[
                    draws.choice(["kinds", "kind_of", "states", "windows", "clashes", "pieces"])
                ]
                if lent.size:
                    lent.flat[draws.integers(lent.size)] = draws.choice(STRANGE)
            structure["windows_left"] = min(int(structure["windows_left"]), 1000)
        for view, true in sizes:
            view[...] = min(int(view), true)
        try:
            yield min(engine.call(function, structure), 0)
        except ValueError:
            yield -1


def main():
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("library", type=Path)
    options.add_argument("--count", type=int, default=2000)
    options.add_argument("--seed", type=int, default=45)
    given = options.parse_args()
    engine, draws = Engine(given.library), np.random.default_rng(given.seed)
    codes = [call(engine, draws) for _ in range(given.count)]
    codes += [call_on_cubics(engine, draws) for _ in range(given.count // 2)]
    codes += [code for _ in range(given.count // 20) for code in call_corrupted(engine, draws)]
    if not set(codes) <= CODES:
        raise EngineError(f"Codes that no outcome has: {set(codes) - CODES}")
    print({code: codes.count(code) for code in sorted(set(codes))})  # noqa: T201 - read by the calling test


if __name__ == "__main__":
    main()
