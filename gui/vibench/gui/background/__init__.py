"""Work that takes longer than a frame, done in spawned processes.

`Background` hands functions to a pool and polls for answers; `LatestRequest` keeps only the newest
question. Functions, arguments and answers must be importable and picklable, and their modules
free of Qt widgets: every process that calls them imports them.
"""
