"""Contact and friction laws; one file has one law, or all damping factors of one formula.

A normal force is an elastic part times (or plus) a damping part, so every stiffness can be combined with every damping.
Friction is a third, independent choice.
"""
