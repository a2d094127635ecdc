"""The Rig page: which bench, is it there, is it well.

The hardware configuration is chosen, knobs that no instrument reports are confirmed, the bench
is opened and checked; findings are written with units and prefixes.
"""
