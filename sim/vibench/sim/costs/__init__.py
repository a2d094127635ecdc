"""What work has cost on this machine: learnt from every run, kept in the user's folder, and soon forgotten.

A plan counts work in seconds of a machine that nobody has. How long a second of it takes here is the mean of
what runs of that kind took lately, and how far a plan may be off is their scatter. Machine, versions and
sources are part of the name under which it is kept: other sources begin anew.
"""
