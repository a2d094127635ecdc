"""Contract tests: whether an instrument keeps the promises of `vibench.acquisition.instruments`.

``pytest --pyargs vibench.acquisition.contract --vibench-instrument NAME --vibench-bench=BENCH.toml`` opens
the bench of the file, which must name the instrument, and plays and reads at most two per cent of its
amplitude limit. Without ``--vibench-bench``, the first shipped virtual bench that names it is taken. Every
instrument of ours passes; docs/instruments.md tells how to write one that does.
"""
