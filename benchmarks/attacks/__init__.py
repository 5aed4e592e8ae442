"""Attacks on files, studies, the explorer and the Python API: each is a script that can be run again.

``python -m benchmarks.attacks.NAME`` prints a table; ``--write`` saves it as a section of docs/decisions/measured/attacks.md.
"""
