"""The parts of the page that are written for the browser: canvas, form and bar, as components of Panel."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import param
from panel.custom import JSComponent

from scissordyn.plot.canvas import CANVAS

MOST_ENTRIES = 20
"""Entries of a message; the page sends fewer."""

ASSETS = Path(__file__).parent / "assets"

ADAPTER = """
const changes = name => name.startsWith("change:") ? name.slice(7) : name;
const SHOWN = ["scene", "ghost"];  // what comes with the run that is shown, see shown.js
export function render({ model, el }) {
  const ends = [];
  const host = {
    get: name => SHOWN.includes(name) ? (window.scissordynShown || {})[name] || "" : model[name],
    set: (name, value) => { model[name] = value; }, save_changes: () => {}, send: content => model.send_msg(content),
    on: (event, reaction) => {
      const name = changes(event), shown = message => { if (name in message.detail) reaction(); };
      if (!SHOWN.includes(name)) { model.on(name, reaction); return; }
      window.addEventListener("scissordyn:shown", shown);
      ends.push(() => window.removeEventListener("scissordyn:shown", shown));
    },
  };
  ends.push(renderMechanism({ model: host, el }));
  model.on("remove", () => ends.forEach(end => end && end()));
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
        # whatever else may come in a message is none of the page's
        if isinstance(message, dict) and len(message) <= MOST_ENTRIES:
            self._heard(message)

    def _get_properties(self, doc: Any) -> dict[str, Any]:
        # what has the name of a bundle is imported as it is: the library would have the browser parse and translate it first,
        # though it is neither TypeScript nor JSX
        return {**super()._get_properties(doc), "bundle": f"scissordyn-{type(self).__name__}"}


class Canvas(_Sender):
    """The mechanism: the anywidget of `canvas.js`."""

    draft = param.String()
    bends = param.Boolean()
    selected = param.String()
    theme = param.String()

    _esm = CANVAS.replace("export default { render };", "").replace("function render(", "function renderMechanism(") + ADAPTER


class Contacts(_Sender):
    """The table of contacts."""

    _esm = "".join((ASSETS / part).read_text(encoding="utf-8") for part in ("numeral.js", "table.js"))


class Form(_Sender):
    """The numbers of the case."""

    fields = param.String("[]")
    errors = param.String("{}")
    typed = param.String("{}")

    _esm = (ASSETS / "form.js").read_text(encoding="utf-8")


class Toolbar(_Sender):
    """Buttons, progress and state."""

    state = param.String("{}")

    _esm = (ASSETS / "toolbar.js").read_text(encoding="utf-8")
