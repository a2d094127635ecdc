"""The force of a power law in the kernels of `vibench.sim.chain`.

The law is that of docs/decisions/0026-power-laws.md.
"""
