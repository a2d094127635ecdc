"""The Rig page: select, open and check a bench.

Select the hardware configuration, confirm settings that no instrument reports, open the bench and check it.
Findings are shown in units with prefixes, such as µV.
"""
