"""The Rig page: select, open and check a bench.

Select the hardware configuration, confirm the settings that instruments cannot report, open the bench and
check it. Findings of the check are shown in units with prefixes, such as µV.
"""
