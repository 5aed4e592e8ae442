"""The catalogue of contact and friction laws: one law a file, damping factors of one formula together.

A normal force is an elastic part times (or plus) a damping part, so every stiffness can be combined with every damping;
friction is a third, separate choice.
"""
