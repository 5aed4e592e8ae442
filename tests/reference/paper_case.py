"""Case file of the paper's array with clearance at joint A."""

__all__ = ["paper_case"]

# Case file of the paper's array; "{until}" is replaced by the end of the run
TEXT = """
[structure]
kind = "scissor"
units = 2

[drive]
speed = "150 rpm"

[[clearance]]
joint = "A"
clearance = "0.5 mm"

[run]
until = "{until}"
"""


def paper_case(until):
    """Return the text of the case, simulated up to a time with its unit."""
    return TEXT.format(until=until)
