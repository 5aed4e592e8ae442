"""Messages about the files of Python that a user names."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest

import scissordyn as sd
from scissordyn.casefile.configuration import read_mechanism, write_configuration
from scissordyn.components.catalogue import component_class
from scissordyn.plugin.element import SLOTS, element_class
from scissordyn.studies.ask.description import OwnMeasure

NAMED: dict[str, Callable[[str], Any]] = {
    **{base.slot.title: partial(element_class, slot, folder=Path()) for slot, base in SLOTS.items()},
    "component": lambda reference: component_class(reference, Path.cwd()),
    "measure": lambda reference: OwnMeasure("late", reference).callable(),
}
"""Functions that read a user-defined element or measure from a file, by kind."""


@pytest.mark.parametrize("kind", NAMED)
def test_a_message_names_the_kind(kind, tmp_path):
    """Contract: a message about a user's file says for what the file was read, and speaks of laws for laws only."""
    file, what = tmp_path / "mine.py", "class" if kind == "component" else "function"
    file.write_text("def other(x):\n    return x\n")
    for reference, says in (
        (f"{tmp_path}/none.py:one", "one"),
        (f"{tmp_path}/mine.txt:one", f"a Python file and a {what} in it"),
        (f"{file}:othr", f"unknown {kind} 'othr' in '{file}' (did you mean 'other'?)"),
    ):
        with pytest.raises(sd.InputError) as caught:
            NAMED[kind](reference)
        message = str(caught.value).replace(str(tmp_path), "")
        assert kind in message
        assert says.replace(str(tmp_path), "") in message
        assert kind.endswith("law") or "law" not in message


def test_a_measure_whose_file_has_changed(tmp_path):
    """Contract: a measure is refused as a measure where its file is no longer what it was."""
    file = tmp_path / "mine.py"
    file.write_text("def late(run):\n    return 1.0\n")
    measure = OwnMeasure("late", f"{file}:late")
    file.write_text("def late(run):\n    return 2.0\n")
    with pytest.raises(sd.InputError, match="has changed since the measure 'late' was loaded"):
        measure.callable()


def test_a_controller_that_is_not_in_a_file():
    """Contract: a run with a controller made in Python asks for a controller in a file, not for a law."""
    controller = sd.element(slot="controller")(lambda error: 0.0 * error)()
    text = write_configuration(sd.four_bar().controlled(controller, speed=1.0))
    with pytest.raises(
        sd.InputError, match=r"as a controller, which is not in a file; .* the controller as 'mine.py:<lambda>'"
    ):
        read_mechanism(text)
