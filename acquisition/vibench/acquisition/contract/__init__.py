"""Contract tests, which check an instrument against the protocols of `vibench.acquisition.instruments`.

``pytest --pyargs vibench.acquisition.contract --vibench-instrument NAME --vibench-bench=BENCH.toml`` opens
the bench in the file, which must name the instrument. Signals are at most 2 % of the bench's amplitude limit.
Without ``--vibench-bench``, the first shipped virtual bench that names the instrument is used. All of
vibench's instruments pass these tests; docs/instruments.md explains how to write an instrument.
"""
