"""The parts of the page that are written for the browser: canvas, form and bar, as components of Panel."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import param
from panel.custom import JSComponent

__all__ = ["Canvas", "Form", "Toolbar"]

ASSETS = Path(__file__).parent / "assets"
CANVAS = (ASSETS / "canvas.js").read_text(encoding="utf-8")

ADAPTER = """
const changes = name => name.startsWith("change:") ? name.slice(7) : name;
export function render({ model, el }) {
  const host = {
    get: name => model[name], set: (name, value) => { model[name] = value; }, save_changes: () => {},
    on: (name, reaction) => model.on(changes(name), reaction), send: content => model.send_msg(content),
  };
  const end = renderMechanism({ model: host, el });
  if (end) model.on("remove", end);
}
"""
"""What Panel calls its model, in the words of anywidget."""


class _Sender(JSComponent):  # type: ignore[misc]
    """A component whose messages go to a function."""

    __abstract = True

    def __init__(self, heard: Callable[[dict[str, Any]], None], **parameters: Any) -> None:
        super().__init__(**parameters)
        self._heard = heard

    def _handle_msg(self, message: Any) -> None:
        if isinstance(message, dict):
            self._heard(message)

    def _get_properties(self, doc: Any) -> dict[str, Any]:
        # what has the name of a bundle is imported as it is: the library would have the browser parse and translate it first,
        # though it is neither TypeScript nor JSX
        return {**super()._get_properties(doc), "bundle": f"scissordyn-{type(self).__name__}"}


class Canvas(_Sender):
    """The mechanism: the anywidget of `canvas.js`."""

    scene = param.String()
    ghost = param.String()
    draft = param.String()
    selected = param.String()
    theme = param.String()

    _esm = CANVAS.replace("export default { render };", "").replace("function render(", "function renderMechanism(") + ADAPTER


class Form(_Sender):
    """The numbers of the case."""

    fields = param.String("[]")
    errors = param.String("{}")
    typed = param.String("{}")

    _esm = (ASSETS / "form.js").read_text(encoding="utf-8")


class Toolbar(_Sender):
    """Buttons, progress and state."""

    state = param.String('{"warnings": []}')

    _esm = (ASSETS / "toolbar.js").read_text(encoding="utf-8")
