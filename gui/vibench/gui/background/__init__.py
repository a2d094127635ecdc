"""Work that takes longer than a frame, done in spawned processes.

`Background` runs functions in a pool of processes and polls for answers; `LatestRequest` keeps only the
newest question. Functions, arguments and answers must be importable and picklable. Their modules must not
import Qt widgets, because every worker process imports these modules.
"""
