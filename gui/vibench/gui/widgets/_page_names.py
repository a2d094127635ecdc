"""Names that pages are called by, on the rail and by each other."""

RIG = "Rig"
TEST = "Test"
RUN = "Run"
FILES = "Files"
COMPARE = "Compare"
SIMULATE = "Simulate"
QUEUE = "Queue"
