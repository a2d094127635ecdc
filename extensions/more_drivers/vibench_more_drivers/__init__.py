"""Drivers of less common instruments: Keysight 33500B, sound cards, and playback of recordings.

An extension of vibench that is found by the entry points in its ``pyproject.toml``. This module contains the
limits of the generator, so that plans can be checked without pyvisa.
"""

from vibench.acquisition.drivers import GeneratorModel, Shape

KEYSIGHT_33500B_MODEL = GeneratorModel(
    # Keysight 33500B data sheet, 20 MHz models: without a filter, waveforms play at up to 62.5 MSa/s.
    name="Keysight 33500B",
    driver="vibench_more_drivers.keysight_33500b:Keysight33500B",
    open_range_vpp=(2e-3, 20.0),
    lowest_hz=1e-6,
    highest_hz={Shape.SINE: 20e6, Shape.EDIT_MEMORY: 62.5e6 / 65_536},
    memory_points=(8, 65_536),
    top_code=65_534,
    burst_cycles=(1, 100_000_000),
    # The product numbers of the models (one or two channels, 20 or 30 MHz) are from public programs.
    usb_ids=tuple((0x0957, product) for product in (0x2507, 0x2607, 0x2707, 0x2807, 0x2A07, 0x2B07, 0x2C07)),
    longest_sweep_s=500.0,  # limit of logarithmic sweeps; linear sweeps may last longer
)
