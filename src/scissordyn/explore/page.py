"""The page: the parts put together, and what they say to each other."""

from __future__ import annotations

import base64
import json
import logging
import threading
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import panel as pn
from bokeh.events import DocumentReady
from bokeh.models import CustomJS
from tornado.ioloop import IOLoop

from scissordyn.errors import InputError, ScissordynError
from scissordyn.explore.cards import cards
from scissordyn.explore.curves import Curves
from scissordyn.explore.first import FirstRun
from scissordyn.explore.legend import differences
from scissordyn.explore.magnified import Larger, wish
from scissordyn.explore.message import number, text, whole
from scissordyn.explore.session import Session
from scissordyn.explore.shell import area
from scissordyn.explore.table import contact_table
from scissordyn.explore.widgets import Canvas, Contacts, Form, Toolbar
from scissordyn.explore.worker import Outcome
from scissordyn.plan.bending import bends
from scissordyn.plot.scale import engineering
from scissordyn.plot.series import largest_forces
from scissordyn.run.joints import clearance_joints

if TYPE_CHECKING:
    import xarray as xr

    from scissordyn.explore.drag import Drag
    from scissordyn.run.summary import Summary

LOOK = 0.2
"""Runs that take longer show their progress, so often [s]; the state of shorter ones does not flicker."""

UNSEEN = 1.0
"""After this time a newer run is sent even if the one before has not been drawn, as in a tab that is not looked at [s]."""

MOST_WAITING = 200
"""Messages of a page that wait for their turn; further ones are dropped."""

FAULT = "a fault of scissordyn: the terminal of the explorer says where"

log = logging.getLogger(__name__)


class Page:
    """One open page with its session, which begins when the case has been read.

    All that is done to the document is done in the document's own turn of the server's loop, see `_later`: what is changed
    elsewhere, in the thread of a run or while a message is being taken in, does not always reach the browser. Nor does what is
    changed while the browser is on its way to get the document: the library's server may send such a change ahead of the
    document, and its browser part drops it then. So nothing is changed between the making of the page and its first word.
    """

    def __init__(self, name: str, first: FirstRun) -> None:
        self.document = pn.state.curdoc
        self.name, self.first = name, first
        self._session: Session | None = None
        self.drag: Drag | None = None
        self.answers = 0
        self.selected = ""
        self.shown: Outcome | None = None
        self._summarized: tuple[Outcome, Summary] | None = None
        self.toolbar = Toolbar(
            lambda message: self._heard(self._asked, message), sizing_mode="stretch_width", styles=area("bar")
        )
        self.form = Form(lambda message: self._heard(self._typed, message), sizing_mode="stretch_both", styles=area("form"))
        self.canvas = Canvas(
            lambda message: self._heard(self._handled, message), sizing_mode="stretch_both", styles=area("canvas")
        )
        self.contacts = Contacts(lambda message: None, sizing_mode="stretch_both", styles=area("table"))
        self.curves = Curves()
        self.larger = Larger(lambda said: self._later(lambda: self._magnified(said)))
        self.canvas.param.watch(lambda event: self._later(self._choose), "selected")
        self._loop = IOLoop.current(instance=False)
        self._lock = threading.Lock()
        self._pending: set[str] = set()
        self._live = self._over = self._watched = self._drawing = self._making = False
        self._waiting = 0
        self._show_waiting()
        self.document.js_on_event(DocumentReady, self.curves.start)
        self.document.js_on_event(DocumentReady, *self._shown_at_first())
        pn.state.onload(lambda: self._later(self._loaded))
        self.document.on_session_destroyed(lambda context: self._closed())
        if first.case is None:
            first.when_read(lambda: self._later(self._begin))
        else:
            self._start()

    def _shown_at_first(self) -> list[CustomJS]:
        return [each for each in self.curves.clock.js_property_callbacks["change:tags"] if isinstance(each, CustomJS)]

    @property
    def session(self) -> Session:
        """The session of the case, which has been read."""
        assert self._session is not None
        return self._session

    def _begin(self) -> None:
        """Start if the page is open and the case has been read, or say why it cannot be."""
        if self._live and self._session is None:
            if self.first.case is not None:
                self._start()
            else:
                self._show_waiting()

    def _start(self) -> None:
        """Show the numbers of the case, and its run when there is one."""
        assert self.first.case is not None
        self._session = Session(self.first.case, self._updated, self.first)
        self._refresh({"fields", "status", "run"})

    def _closed(self) -> None:
        self._over = True
        if self._session is not None:
            self._session.close()

    def show(self) -> None:
        """Put the parts of the page into its document, each for itself: when one changes its size, the others stay."""
        for part in (self.toolbar, self.form, self.canvas, self.contacts):
            part.server_doc(self.document, location=False)
        for figure in (self.curves.orbit, self.curves.stack):
            self.document.add_root(figure)

    def _later(self, action: Callable[[], None], after: float = 0.0) -> None:
        """Do something in the document's own turn, from any thread."""

        def turn() -> None:
            try:
                action()
            except ScissordynError as error:
                self._say(str(error))
            except Exception:
                log.exception(FAULT)
                self._say(FAULT)

        def enqueue() -> None:
            if not self._over:
                self.document.add_next_tick_callback(turn)

        assert self._loop is not None
        if after:
            self._loop.add_callback(self._loop.call_later, after, enqueue)
        else:
            self._loop.add_callback(enqueue)

    # what comes from the session, also from its thread

    def _updated(self, what: str) -> None:
        """Note what has changed, and have it shown in the document's own turn; once, however much comes together."""
        with self._lock:
            first = not self._pending
            self._pending.add(what)
        if first:
            self._later(self._flush)

    def _flush(self) -> None:
        if not self._live:  # then `_loaded` does it
            return
        with self._lock:
            what, self._pending = self._pending, set()
        if what and self._session is not None:
            self._refresh(what)

    def _loaded(self) -> None:
        """The page is open: from now on it says what it has drawn."""
        self._live = True
        self._begin()
        self._flush()
        if self._session is not None and self.session.computing:
            self._watch()

    def _refresh(self, what: set[str]) -> None:
        """Show what has changed."""
        if "computing" in what and not self._watched:
            self._watched = True
            self._later(self._watch, LOOK)
        if "fields" in what:
            self._show_fields()
        if "pins" in what:
            self._publish(pins=True)
        if "fine" in what and self.session.good is self.shown:  # else they come with their run
            self._publish()
        if "run" in what:
            self._show_run()
        elif "status" in what and self.drag is None and self.canvas.draft:
            self.canvas.draft = ""  # what was dragged cannot be run
        if what - {"computing", "fine"}:
            self._show_state()

    def _watch(self) -> None:
        """Show how far a run is that takes long."""
        self._watched = self._live and self.session.computing
        if self._watched:
            self._show_state()
            self._later(self._watch, LOOK)

    # the run that is shown: all of it goes to the browser in one message, and the next when it has been drawn

    def _show_run(self) -> None:
        """Show the newest run, unless the browser is still drawing the one before: then when it has."""
        good = self.session.good
        if good is None or good.run is None or good is self.shown or self._drawing:
            return
        self.shown = good
        self.canvas.bends = bends(good.case.mechanism)
        if self.selected not in clearance_joints(good.run):
            self.selected = _heaviest(good)
        self._drawing = self._live
        self._publish(scene=True)
        if self._drawing:
            self._later(lambda: self._drawn(good.number), UNSEEN)

    def _drawn(self, number: int) -> None:
        """The browser has drawn a run, or has had the time to."""
        if self._drawing and self.shown is not None and self.shown.number == number:
            self._drawing = False
            self._show_run()
            self._show_state()

    def _publish(self, *, scene: bool = False, pins: bool = False) -> None:
        """Send what is shown of the present run, with its number: as one change of one model, which arrives as a whole."""
        if self.shown is None or self.shown.run is None:
            return
        from scissordyn.run.summary import summary_of  # loads the laws, which the page does not wait for

        run, case, pinned = self.shown.run, self.shown.case, self.session.pins
        if self._summarized is None or self._summarized[0] is not self.shown:
            self._summarized = self.shown, summary_of(run)
        summary = self._summarized[1]
        parts: dict[str, Any] = {"bar": self._bar(self.shown), "cards": cards(summary)}
        if scene or pins:
            from scissordyn.plot.canvas import packed_scene

            if scene:
                magnified = self.larger.scene(self.shown)
                parts["scene"] = magnified or packed_scene(run, case.mechanism, number=self.shown.number)
                parts["table"] = contact_table(run)
            if pins:
                parts["ghost"] = packed_scene(pinned[-1].run, pinned[-1].case.mechanism) if pinned else ""
        kept = [pin.run for pin in pinned]
        factor, drawn = self.curves.drawn(self._sampled(run), summary, kept, self.selected, case.mechanism.output_body)
        self.curves.clock.tags = [factor, self.shown.number, {**drawn, "parts": parts}]

    def _sampled(self, run: xr.Dataset) -> xr.Dataset:
        """A run as its curves are drawn: with the instants of its contacts, when it has been computed with them."""
        fine = self.session.fine
        return run if fine is None or self.session.good is not self.shown else fine

    def _bar(self, shown: Outcome) -> dict[str, Any]:
        """What the bar says of a run."""
        from scissordyn.run.advice import condensed  # as above

        assert shown.run is not None
        statistics = json.loads(shown.run.attrs["statistics"])
        pins = self.session.pins
        scale = engineering("s", statistics["seconds"])
        lasting = f"{scale.factor * statistics['seconds']:.3g} {scale.unit}"
        said = f"{shown.note}{': ' * bool(shown.note)}{statistics['steps']} steps"
        return {
            "note": shown.note,
            "fine": self._sampled(shown.run) is not shown.run,
            "text": f"{said} of {statistics['method']} in {lasting}",
            "pins": len(pins),
            "legend": self._legend(shown),
            "warnings": condensed(json.loads(shown.run.attrs["warnings"])),
        }

    def _legend(self, shown: Outcome) -> list[list[str]]:
        """Colours and numbers of the runs that are compared, the one that is shown first; empty without others."""
        pins = self.session.pins[::-1]
        if not pins:
            return []
        told = differences([shown.case, *(pin.case for pin in pins)])
        return [list(each) for each in zip(self.curves.colors(len(pins)), told, strict=True)]

    # what is not of a run

    def _show_fields(self) -> None:
        self.form.fields = json.dumps([field.plain() for field in self.session.case.fields])
        self.form.typed = json.dumps(self.session.typed)
        self.form.errors = json.dumps(self.session.errors)

    def _show_waiting(self) -> None:
        """Say that the case is being read, or why it cannot be."""
        error = self.first.error
        said = "reading the case" if error is None else str(error)
        self.toolbar.state = json.dumps({"name": self.name, "text": said, "computing": error is None, "bad": error is not None})

    def _show_state(self) -> None:
        session = self.session
        preceding = self.shown is None or bool(self.shown.note)
        # a run that precedes another is not what the page waits for
        computing = session.lasting > LOOK or (preceding and (session.computing or self.shown is not session.good))
        state = {
            "name": self.name,
            "undo": session.can_undo,
            "redo": session.can_redo,
            "file": session.case.text() is not None,
            "horizon": session.case.options.trust,
            "computing": computing,
            "ordered": session.ordered,
            "fraction": session.fraction or 0.0,
            "text": _doing(session) if computing else session.message,
            "bad": bool(session.message) and not computing,
        }
        self.toolbar.state = json.dumps(state)

    # what comes from the browser

    def _heard(self, answer: Callable[[dict[str, Any]], None], message: dict[str, Any]) -> None:
        """Answer a message in the document's own turn."""
        if self._waiting >= MOST_WAITING or self._over:
            return
        self._waiting += 1

        def turn() -> None:
            self._waiting -= 1
            if self._session is not None or message.get("type") == "theme":
                answer(message)

        self._later(turn)

    def _typed(self, message: dict[str, Any]) -> None:
        self.session.change(text(message, "key"), text(message, "text"), final=bool(message.get("final", True)))

    def _choose(self) -> None:
        if self.shown is not None and self.shown.run is not None and self.canvas.selected in clearance_joints(self.shown.run):
            self.selected = str(self.canvas.selected)
            self._publish()

    def _asked(self, message: dict[str, Any]) -> None:
        kind = text(message, "type")
        if kind == "theme":
            self.curves.theme(dark=bool(message.get("dark")))
            self._publish()
        elif kind == "drawn":
            self._drawn(whole(message, "run"))
        elif kind == "horizon":
            self.session.horizon(bool(message.get("wanted")))
        elif kind in ("undo", "redo", "unpin", "stop"):
            getattr(self.session, kind)()
        elif kind == "pin":
            self._pin()
        elif kind == "python":
            from scissordyn.explore.python_code import python_of

            self.toolbar._send_msg({"type": "python", "text": python_of(self.session.case)})
        elif kind in ("case", "run", "curves", "picture", "film"):
            self._save(kind, number(message, "time"))

    def _pin(self) -> None:
        if self.shown is not None and self.shown.run is not None:
            self.session.pin(replace(self.shown, run=self._sampled(self.shown.run)))

    def _save(self, what: str, time: float) -> None:
        """Make a file in a thread, as a film takes seconds: one for this page, and few for all pages."""
        from scissordyn.explore.save import MOST_MADE, saved, slots  # with matplotlib, which the page does not need

        if self._making:
            raise InputError(f"'{what}' is asked for while another file is being made", "one file at a time", "wait for it")
        if not slots.acquire(blocking=False):
            raise InputError(
                f"'{what}' is asked for while {MOST_MADE} other pages make files", "two at a time", "try again soon"
            )
        self._making = True
        shown, joint = self.shown, self.selected
        fine = None if shown is None or shown.run is None else self._sampled(shown.run)
        magnify = 1.0 if shown is None else self.larger.factor(shown)

        def make() -> None:
            try:
                name, mime, content = saved(self.session, shown, fine, what, time, joint, magnify)
            except ScissordynError as error:
                self._later(lambda said=str(error): self._say(said))  # type: ignore[misc]
            except Exception:
                log.exception(FAULT)
                self._later(lambda: self._say(FAULT))
            else:
                made = {"type": "file", "name": name, "mime": mime, "content": base64.b64encode(content).decode()}
                self._later(lambda: self.toolbar._send_msg(made))
            finally:
                self._making = False
                slots.release()

        threading.Thread(target=make, name="scissordyn saves", daemon=True).start()

    def _say(self, said: str) -> None:
        if self._session is not None:
            self.session.message = said
            self._show_state()

    def _draft(self) -> None:
        """Show what the drag has made; each answer differs from the one before, as the browser waits for it."""
        from scissordyn.plot.canvas import packed_scene

        assert self.drag is not None
        self.answers += 1
        note = f"Drag: {self.drag.note}" if self.drag.note else "Drag"
        self.canvas.draft = packed_scene(self.drag.run, self.drag.ideal, number=self.answers, note=note)

    def _magnified(self, said: str) -> None:
        """Show what has been magnified, or say why it cannot be."""
        if said:
            self._say(said)
        elif self.drag is None:
            self._publish(scene=True)

    def _handled(self, message: dict[str, Any]) -> None:
        """What is done in the drawing: deflections are magnified, or a part is dragged."""
        if message.get("type") != "magnify":
            self._dragged(message)
            return
        self.larger.wanted = wish(message.get("factor"))
        self._publish(scene=True)

    def _dragged(self, message: dict[str, Any]) -> None:
        from scissordyn.explore.drag import Drag

        phase = text(message, "phase")
        try:
            if phase == "start":
                self.drag = None
                self.drag = Drag(self.session.case, text(message, "kind"), text(message, "name"))
                self._draft()
            elif self.drag is not None:
                self.drag.to(number(message, "dx"), number(message, "dy"), steps=2 if phase == "move" else 4)
                self._draft()
        except ScissordynError as error:
            self._say(str(error))
            if self.drag is not None:
                self._draft()
        if phase == "end" and self.drag is not None:
            texts, self.drag = self.drag.texts, None
            if not (texts and self.session.change_all(texts)):
                self.canvas.draft = ""


def _doing(session: Session) -> str:
    """What the page waits for."""
    return "computing" if session.fraction else "preparing"


def _heaviest(good: Outcome) -> str:
    """The clearance joint with the largest force; "" without any."""
    assert good.run is not None
    if not clearance_joints(good.run):
        return ""
    largest = largest_forces(good.run)
    return max(largest, key=lambda name: largest[name])
