"""Pictures in notebooks."""

from matplotlib.figure import Figure

from scissordyn.plot.joint import force, orbit
from scissordyn.plot.over_time import energy


def test_notebooks_show_pictures(run):
    """Contract: what a plot function returns has a PNG, which a notebook shows, also with Axes of the user."""
    own = Figure().add_subplot()
    for drawn in (force(run), orbit(run), energy(run), orbit(run, joint="A", axes=own)):
        assert drawn._repr_png_().startswith(b"\x89PNG")
