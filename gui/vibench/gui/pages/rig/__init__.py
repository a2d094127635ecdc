"""The Rig page: which bench, is it there, is it well.

Select the hardware configuration, confirm knobs that no instrument reports, open the bench and check it.
Findings are shown with units and prefixes.
"""
