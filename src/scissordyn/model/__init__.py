"""Description of a mechanism: bodies, joints, drives, gravity.

A description is a frozen dataclass with annotated fields (`units.Quantity`, `units.Meaning`) and without computation: a
mechanism, one of its parts, a law, or the options of a run.
"""
