"""The page: the parts put together, and what they say to each other."""

from __future__ import annotations

import base64
import json
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import panel as pn
from bokeh.events import DocumentReady

from scissordyn.errors import ScissordynError
from scissordyn.explore.curves import Curves
from scissordyn.explore.first import FirstRun
from scissordyn.explore.session import Session
from scissordyn.explore.shell import area
from scissordyn.explore.table import ContactTable
from scissordyn.explore.widgets import Canvas, Form, Toolbar
from scissordyn.explore.worker import Outcome
from scissordyn.plot.scale import engineering
from scissordyn.plot.series import clearance_joints, largest_forces

if TYPE_CHECKING:
    from scissordyn.explore.drag import Drag

__all__ = ["Page"]

LOOK = 200
"""Runs that take longer show their progress, so often [ms]; the state of shorter ones does not flicker."""

UNSEEN = 1000
"""After this time all of a run is sent even if its curves have not been drawn, as in a tab that is not looked at [ms]."""


class Page:
    """One open page with its session, which begins when the case has been read.

    Parameters
    ----------
    name : str
        Of the case.
    first : FirstRun
        The case as it is opened, and its run.
    """

    def __init__(self, name: str, first: FirstRun) -> None:
        self.document = pn.state.curdoc
        self.name, self.first = name, first
        self._session: Session | None = None
        self.drag: Drag | None = None
        self.dark = False
        self.answers = 0
        self.selected = ""
        self.toolbar = Toolbar(self._asked, sizing_mode="stretch_width", styles=area("bar"))
        self.form = Form(self._typed, sizing_mode="stretch_both", styles=area("form"))
        self.canvas = Canvas(self._dragged, sizing_mode="stretch_both", styles=area("canvas"))
        self.curves = Curves()
        self.contacts = ContactTable()
        self.canvas.param.watch(self._choose, "selected")
        self._lock = threading.Lock()
        self._pending: set[str] = set()
        self._live = self._watched = self._drawing = False
        self._late: set[str] = set()
        self._show_waiting()
        self.document.js_on_event(DocumentReady, self.curves.start)
        pn.state.onload(self._loaded)
        self.document.on_session_destroyed(lambda context: self._closed())
        if first.case is None:
            first.when_read(lambda: self._later(self._begin))
        else:
            self._begin()

    @property
    def session(self) -> Session:
        """The session of the case, which has been read."""
        assert self._session is not None
        return self._session

    def _begin(self) -> None:
        """The case has been read: show its numbers, and its run when there is one."""
        if self.first.case is None or self._session is not None:
            self._show_waiting()
            return
        self._session = Session(self.first.case, self._updated, self.first)
        self._show_fields()
        self._refresh({"status", *({"run"} if self.session.good else ())})

    def _closed(self) -> None:
        if self._session is not None:
            self._session.close()

    def show(self) -> None:
        """Put the parts of the page into its document, each for itself: when one changes its size, the others stay."""
        for part in (self.toolbar, self.form, self.canvas):
            part.server_doc(self.document, location=False)
        for figure in (self.curves.orbit, self.contacts.table, self.curves.stack):
            self.document.add_root(figure)

    # what comes from the session, also from its thread

    def _updated(self, what: str) -> None:
        """Note what has changed, and have it shown in the page's own turn; once, however much comes together."""
        if what == "computing":
            if self._live and not self._watched:
                self._watched = True
                self._later(lambda: self.document.add_timeout_callback(self._watch, LOOK))
            return
        with self._lock:
            first = not self._pending
            self._pending.add(what)
        if first and self._live:
            self._later(self._flush)

    def _flush(self) -> None:
        with self._lock:
            what, self._pending = self._pending, set()
        if what:
            self._refresh(what)

    def _loaded(self) -> None:
        """The page is open: from now on it gets what changes."""
        self._live = True
        if self._session is None:
            return
        self._flush()
        if self.session.computing:
            self._updated("computing")

    def _watch(self) -> None:
        """Show how far a run is that takes long."""
        self._watched = self.session.computing
        if self._watched:
            self._catch_up()
            self.document.add_timeout_callback(self._watch, LOOK)

    def _later(self, action: Callable[[], None]) -> None:
        """Do something in the page's own turn."""
        self.document.add_next_tick_callback(action)

    def _refresh(self, what: set[str]) -> None:
        """Show what has changed: of a new run its curves, and the rest when the browser has drawn them."""
        known = self.session.good
        run = "run" in what and known is not None and known.run is not None
        self._late |= what - {"run"}
        if run:
            self._late.add("scene")
            self._drawing = self._live
        waiting = self._drawing or (self._live and self.session.computing)
        if run:
            with self._together():
                self._show_run()
            if waiting and known is not None:
                self.document.add_timeout_callback(lambda: self._drawn(known.number), UNSEEN)
        if not waiting:
            self._catch_up()

    def _drawn(self, number: int) -> None:
        """The browser has drawn the curves of a run, or has had the time to."""
        good = self.session.good
        if self._drawing and good is not None and good.number == number:
            self._drawing = False
            self._catch_up()

    def _catch_up(self) -> None:
        """Show what has waited for the curves."""
        late, self._late = self._late, set()
        with self._together():
            if "fields" in late:
                self._show_fields()
            if "scene" in late:
                self._show_scene()
            if "pins" in late:
                self._show_pins()
            self._show_state()

    @contextmanager
    def _together(self) -> Iterator[None]:
        """Send the changes of a block as one message."""
        self.document.hold("combine")
        try:
            yield
        finally:
            self.document.unhold()

    def _show_fields(self) -> None:
        self.form.fields = json.dumps([field.plain() for field in self.session.case.fields])
        self.form.typed = json.dumps(self.session.typed)
        self.form.errors = json.dumps(self.session.errors)

    def _show_run(self) -> None:
        good = self.session.good
        if good is None or good.run is None:
            return
        known = clearance_joints(good.run)
        if self.selected not in known:
            self.selected = _heaviest(good)
        self._show_curves()

    def _show_scene(self) -> None:
        good = self.session.good
        if good is None or good.run is None:
            return
        from scissordyn.explore.scene import packed_scene

        self.canvas.scene = packed_scene(good.run, good.case.mechanism, number=good.number)
        self.canvas.draft = ""
        self.contacts.show(good.run)

    def _show_curves(self) -> None:
        good = self.session.good
        if good is not None and good.run is not None:
            pins = [pin.run for pin in self.session.pins]
            self.curves.show(good.run, pins, self.selected, good.case.mechanism.output_body, good.number)

    def _show_pins(self) -> None:
        from scissordyn.explore.scene import packed_scene

        pins = self.session.pins
        self.canvas.ghost = packed_scene(pins[-1].run, pins[-1].case.mechanism) if pins else ""
        self._show_curves()

    def _show_waiting(self) -> None:
        """Say that the case is being read, or why it cannot be."""
        error = self.first.error
        self._show_bar(text="reading the case" if error is None else str(error), computing=error is None, bad=error is not None)

    def _show_state(self) -> None:
        session = self.session
        good = session.good
        computing = session.lasting > 1e-3 * LOOK
        if computing:
            said = "computing" if session.fraction else "preparing"
        elif session.message:
            said = session.message
        elif good is not None and good.run is not None:
            statistics = json.loads(good.run.attrs["statistics"])
            pinned = f"; pinned: {'; '.join(pin.label for pin in session.pins)}" if session.pins else ""
            scale = engineering("s", statistics["seconds"])
            lasting = f"{scale.factor * statistics['seconds']:.3g} {scale.unit}"
            said = f"{statistics['steps']} steps of {statistics['method']} in {lasting}{pinned}"
        else:
            said = ""
        self._show_bar(
            undo=session.can_undo,
            redo=session.can_redo,
            pins=len(session.pins),
            run=good is not None,
            file=session.case.text() is not None,
            horizon=session.case.options.trust,
            computing=computing,
            fraction=session.fraction or 0.0,
            text=said,
            bad=bool(session.message) and not computing,
            number=0 if good is None else good.number,
            warnings=session.warnings,
        )

    def _show_bar(
        self,
        *,
        text: str,
        computing: bool,
        bad: bool,
        undo: bool = False,
        redo: bool = False,
        pins: int = 0,
        run: bool = False,
        file: bool = False,
        horizon: bool = False,
        fraction: float = 0.0,
        number: int = 0,
        warnings: Sequence[str] = (),
    ) -> None:
        shown = {name: value for name, value in locals().items() if name != "self"}
        self.toolbar.state = json.dumps({**shown, "name": self.name, "warnings": list(warnings)})

    # what comes from the browser

    def _typed(self, message: dict[str, Any]) -> None:
        if self._session is None:
            return
        self.session.change(str(message["key"]), str(message["text"]), final=bool(message.get("final", True)))

    def _choose(self, event: Any) -> None:
        if self._session is None:
            return
        good = self.session.good
        if good is not None and good.run is not None and event.new in clearance_joints(good.run):
            self.selected = str(event.new)
            self._show_curves()

    def _asked(self, message: dict[str, Any]) -> None:
        kind = message.get("type")
        if kind == "theme":
            self.dark = bool(message.get("dark"))
            self.curves.theme(dark=self.dark)
            return
        if self._session is None:
            return
        simple = {
            "undo": self.session.undo,
            "redo": self.session.redo,
            "pin": self.session.pin,
            "unpin": self.session.unpin,
            "stop": self.session.stop,
        }
        if kind in simple:
            simple[str(kind)]()
        elif kind == "horizon":
            self.session.horizon(bool(message.get("wanted")))
        elif kind == "drawn":
            self._drawn(int(message.get("run", 0)))
        elif kind == "python":
            from scissordyn.explore.python_code import python_of

            self._tell(lambda: {"type": "python", "text": python_of(self.session.case)})
        elif kind in ("case", "run", "picture", "film"):
            time = message.get("time", 0.0)
            instant = float(time) if isinstance(time, int | float) else 0.0
            # a film takes seconds: the page goes on meanwhile
            threading.Thread(target=self._make, args=(str(kind), instant), daemon=True).start()

    def _make(self, what: str, time: float) -> None:
        def made() -> dict[str, Any]:
            from scissordyn.explore.save import saved  # with matplotlib, which the page does not need

            name, mime, content = saved(self.session, what, time)
            return {"type": "file", "name": name, "mime": mime, "content": base64.b64encode(content).decode()}

        try:
            message = made()
        except ScissordynError as error:
            self._later(lambda said=str(error): self._say(said))  # type: ignore[misc]
            return
        self._later(lambda: self.toolbar._send_msg(message))

    def _tell(self, made: Callable[[], dict[str, Any]]) -> None:
        try:
            self.toolbar._send_msg(made())
        except ScissordynError as error:
            self._say(str(error))

    def _say(self, text: str) -> None:
        self.session.message = text
        self._show_state()

    def _draft(self) -> None:
        """Show what the drag has made; each answer differs from the one before, as the browser waits for it."""
        from scissordyn.explore.scene import packed_scene

        assert self.drag is not None
        self.answers += 1
        note = f"Drag: {self.drag.note}" if self.drag.note else "Drag"
        self.canvas.draft = packed_scene(self.drag.run, self.drag.ideal, number=self.answers, note=note)

    def _dragged(self, message: dict[str, Any]) -> None:
        if self._session is None:
            return
        from scissordyn.explore.drag import Drag

        phase = message.get("phase")
        try:
            if phase == "start":
                self.drag = Drag(self.session.case, str(message["kind"]), str(message["name"]))
                self._draft()
            elif self.drag is not None:
                self.drag.to(float(message["dx"]), float(message["dy"]), steps=2 if phase == "move" else 4)
                self._draft()
        except ScissordynError as error:
            self._say(str(error))
            if phase == "start":
                self.drag = None
            elif self.drag is not None:
                self._draft()
        if phase == "end" and self.drag is not None:
            texts, self.drag = self.drag.texts, None
            if not (texts and self.session.change_all(texts)):
                self.canvas.draft = ""


def _heaviest(good: Outcome) -> str:
    """The clearance joint with the largest force; "" without any."""
    assert good.run is not None
    if not clearance_joints(good.run):
        return ""
    largest = largest_forces(good.run)
    return max(largest, key=lambda name: largest[name])
