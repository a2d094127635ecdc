"""Work that takes longer than one frame of the display, done in spawned processes.

`Background` runs functions in a pool of processes and polls for results; `LatestRequest` computes only the
newest request. Functions, arguments and results must be importable and picklable. Their modules must not
import Qt widgets, because every worker process imports these modules.
"""
