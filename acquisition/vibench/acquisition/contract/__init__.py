"""Contract tests: whether an instrument implements the protocols of `vibench.acquisition.instruments`.

``pytest --pyargs vibench.acquisition.contract --vibench-instrument NAME --vibench-bench=BENCH.toml`` opens
the bench of the file, which must name the instrument, and plays and reads at most two per cent of its
amplitude limit. Without ``--vibench-bench``, the first shipped virtual bench that names it is used. All our
instruments pass; docs/instruments.md explains how to write one.
"""
