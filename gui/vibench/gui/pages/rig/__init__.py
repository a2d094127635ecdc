"""The Rig page: select, open and check a bench.

Select the hardware configuration, confirm knobs that no instrument reports, open the bench and check it.
Findings are shown with units and prefixes.
"""
