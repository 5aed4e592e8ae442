"""One open page: the messages that it gets of its session, and what it asks for."""

from __future__ import annotations

import json
import logging
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from scissordyn.errors import InputError, ScissordynError
from scissordyn.explore.cards import cards
from scissordyn.explore.figures import NOW, PINNED, figures
from scissordyn.explore.legend import differences
from scissordyn.explore.magnified import Larger, wish
from scissordyn.explore.message import number, text, whole
from scissordyn.explore.session import Session
from scissordyn.explore.table import contact_table
from scissordyn.explore.worker import Outcome
from scissordyn.plan.bending import bends
from scissordyn.plot.canvas import packed_scene
from scissordyn.plot.scale import engineering
from scissordyn.plot.series import largest_forces
from scissordyn.run.answer.advice import warnings_of
from scissordyn.run.answer.joints import clearance_joints
from scissordyn.run.answer.summary import summary_of
from scissordyn.warning import group, line

if TYPE_CHECKING:
    import xarray as xr

    from scissordyn.explore.drag import Drag
    from scissordyn.run.answer.summary import Summary

FAULT = "a fault of scissordyn: the terminal of the explorer says where"

log = logging.getLogger(__name__)

Message = Mapping[str, Any]


class Page:
    """One open page with its session; what it does is done by one thread at a time.

    Parameters
    ----------
    session : Session
    send : callable
        Takes messages to the browser, see page.js.
    """

    def __init__(self, session: Session, send: Callable[[Message], None]) -> None:
        self.session, self.send = session, send
        self.drag: Drag | None = None
        self.selected = ""
        self.shown: Outcome | None = None
        self._summary: tuple[Outcome, Summary] | None = None
        self._lock = threading.RLock()
        self._drawing = self._making = False
        self._answers = 0
        self.larger = Larger(self._magnified)
        self._answering: dict[str, Callable[[Message], None]] = {
            "change": self._change,
            "select": self._select,
            "drawn": lambda message: self._drawn(whole(message, "run")),
            "horizon": lambda message: session.horizon(bool(message.get("wanted"))),
            "magnify": self._magnify,
            "drag": self._dragged,
            "pin": self._pin,
            "python": self._python,
            "axis": lambda message: self._show_points(text(message, "name")),
            "open": self._open,
            **{kind: self._call(getattr(session, kind)) for kind in ("undo", "redo", "unpin", "stop")},
            **dict.fromkeys(("case", "run", "curves", "picture", "film"), self._save),
        }

    def begin(self) -> None:
        """Show the numbers of the case, and what there is of its run."""
        with self._lock:
            self.session.updated = self._updated
            if self.session.opened.points is not None:
                self._show_points(self.session.opened.points.axes[0])
            for what in ("fields", "status", "run"):
                self._updated(what)

    def close(self) -> None:
        """End the page."""
        self.session.close()

    # what comes from the session, also from its thread

    def _updated(self, what: str) -> None:
        with self._lock:
            if what == "fields":
                self._show_fields()
            elif what == "pins":
                self._publish(pins=True)
            elif what == "fine" and self.session.good is self.shown:  # else they come with their run
                self._publish()
            elif what == "run":
                self._show_run()
            elif what == "status" and self.drag is None and not self.session.computing and self.session.message:
                self.send({"type": "draft", "draft": ""})  # what was dragged cannot be run
            if what != "fine":
                self._show_state()

    # the run that is shown: all of it goes to the browser in one message, and the next when it has been drawn

    def _show_run(self) -> None:
        """Show the newest run, unless the browser is still drawing the one before: then when it has."""
        good = self.session.good
        if good is None or good.run is None or good is self.shown or self._drawing:
            return
        self.shown, self._drawing = good, True
        if self.selected not in clearance_joints(good.run):
            self.selected = _heaviest(good)
        self._publish(scene=True)

    def _drawn(self, run: int) -> None:
        if self.shown is not None and self.shown.number == run:
            self._drawing = False
            self._show_run()
            self._show_state()

    def _publish(self, *, scene: bool = False, pins: bool = False) -> None:
        """Send what is shown of the present run, with its number, as one message."""
        if self.shown is None or self.shown.run is None:
            return
        run, mechanism, pinned = self.shown.run, self.shown.case.mechanism, self.session.pins
        if self._summary is None or self._summary[0] is not self.shown:
            self._summary = self.shown, summary_of(run)
        summary = self._summary[1]
        message: dict[str, Any] = {
            "type": "run",
            "run": self.shown.number,
            "bar": self._bar(self.shown),
            "cards": cards(summary),
            **figures(self._sampled(run), summary, [pin.run for pin in pinned], self.selected, mechanism.output_body),
        }
        if scene:
            message |= {
                "scene": self.larger.scene(self.shown) or packed_scene(run, mechanism, number=self.shown.number),
                "table": contact_table(run),
                "bends": bends(mechanism),
                "selected": self.selected,
            }
        if pins:
            message["ghost"] = packed_scene(pinned[-1].run, pinned[-1].case.mechanism) if pinned else ""
        self.send(message)

    def _sampled(self, run: xr.Dataset) -> xr.Dataset:
        """A run as its curves are drawn: with the instants of its contacts, when it has been computed with them."""
        fine = self.session.fine
        return run if fine is None or self.session.good is not self.shown else fine

    def _bar(self, shown: Outcome) -> dict[str, Any]:
        """What the bar says of a run."""
        assert shown.run is not None
        statistics = json.loads(shown.run.attrs["statistics"])
        pins = self.session.pins[::-1]
        scale = engineering("s", statistics["seconds"])
        steps = (
            f"{statistics['steps']} steps of {statistics['method']} in {scale.factor * statistics['seconds']:.3g} {scale.unit}"
        )
        legend = differences([shown.case, *(pin.case for pin in pins)]) if pins else []
        return {
            "note": shown.note,
            "fine": self._sampled(shown.run) is not shown.run,
            "text": f"{shown.note}: {steps}" if shown.note else steps,
            "pins": len(pins),
            "legend": [list(pair) for pair in zip((NOW, *PINNED), legend, strict=False)],
            "warnings": [line(alike) for alike in group(warnings_of(shown.run))],
        }

    # what is not of a run

    def _show_points(self, axis: str) -> None:
        points = self.session.opened.points
        if points is None or axis not in points.axes:
            raise InputError(f"points over '{axis}'", "the numbers of a study that vary")
        self.send(
            {"type": "points", "axes": list(points.axes), "axis": axis, "note": points.note, "figures": points.figures(axis)}
        )

    def _open(self, message: Message) -> None:
        points = self.session.opened.points
        if points is None:
            raise InputError("a point of a case that is no study", "a study or a bifurcation diagram")
        self.session.open(points.opened(whole(message, "point")))

    def _show_fields(self) -> None:
        session = self.session
        fields = [field.plain() for field in session.case.fields]
        self.send({"type": "form", "fields": fields, "typed": session.typed, "errors": session.errors})

    def _show_state(self) -> None:
        session = self.session
        self.send(
            {
                "type": "state",
                "undo": session.can_undo,
                "redo": session.can_redo,
                "file": session.case.text() is not None,
                "horizon": session.case.options.trust,
                "computing": session.computing or self.shown is not session.good,
                "ordered": session.ordered,
                "fraction": session.fraction or 0.0,
                "lasting": session.lasting,
                "left": session.left,
                "name": session.case.name,
                "text": "" if session.computing else session.message,
            }
        )

    # what comes from the browser

    def hear(self, content: str | bytes) -> None:
        """Answer a message; what cannot be understood gets one line, without traces or paths."""
        try:
            message = json.loads(content) if isinstance(content, str) else None
        except (ValueError, RecursionError):
            message = None
        answer = self._answering.get(str(message.get("type"))) if isinstance(message, dict) else None
        if answer is None:
            self._complain("a message that the page does not send")
            return
        with self._lock, self._in_one_line():
            answer(message)  # type: ignore[arg-type]

    @contextmanager
    def _in_one_line(self) -> Iterator[None]:
        """What goes wrong is one line on the page; a fault of the program is in the terminal, too."""
        try:
            yield
        except ScissordynError as error:
            self._complain(str(error))
        except Exception:
            log.exception(FAULT)
            self._complain(FAULT)

    def _complain(self, words: str) -> None:
        self.send({"type": "said", "text": words})

    def _call(self, action: Callable[[], None]) -> Callable[[Message], None]:
        return lambda message: action()

    def _change(self, message: Message) -> None:
        self.session.change(text(message, "key"), text(message, "text"), final=bool(message.get("final", True)))

    def _select(self, message: Message) -> None:
        joint = text(message, "name")
        if self.shown is not None and self.shown.run is not None and joint in clearance_joints(self.shown.run):
            self.selected = joint
            self._publish()

    def _python(self, message: Message) -> None:
        from scissordyn.explore.python_code import python_of

        self.send({"type": "python", "text": python_of(self.session.case)})

    def _pin(self, message: Message) -> None:
        if self.shown is not None and self.shown.run is not None:
            self.session.pin(replace(self.shown, run=self._sampled(self.shown.run)))

    def _save(self, message: Message) -> None:
        """Make a file in a thread, as a film takes seconds: one for this page, and few for all pages."""
        from scissordyn.explore.save import MOST_MADE, saved, slots  # with matplotlib, which the page does not need

        what, time = text(message, "type"), number(message, "time")
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
                with self._in_one_line():
                    name, mime, content = saved(self.session, shown, fine, what, time, joint, magnify)
                    self.send({"type": "file", "name": name, "mime": mime, "content": content})
            finally:
                self._making = False
                slots.release()

        threading.Thread(target=make, name="scissordyn saves", daemon=True).start()

    def _magnify(self, message: Message) -> None:
        self.larger.wanted = wish(message.get("factor"))
        self._publish(scene=True)

    def _magnified(self, error: str) -> None:
        """Show what has been magnified, or say why it cannot be."""
        with self._lock:
            if error:
                self._complain(error)
            elif self.drag is None:
                self._publish(scene=True)

    def _dragged(self, message: Message) -> None:
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
            self._complain(str(error))
            if self.drag is not None:
                self._draft()
        if phase == "end" and self.drag is not None:
            texts, self.drag = self.drag.texts, None
            if not (texts and self.session.change_all(texts)):
                self.send({"type": "draft", "draft": ""})

    def _draft(self) -> None:
        """Show what the drag has made; each answer differs from the one before, as the browser waits for it."""
        assert self.drag is not None
        self._answers += 1
        note = f"Drag: {self.drag.note}" if self.drag.note else "Drag"
        self.send({"type": "draft", "draft": packed_scene(self.drag.run, self.drag.ideal, number=self._answers, note=note)})


def _heaviest(good: Outcome) -> str:
    """The clearance joint with the largest force; "" without any."""
    assert good.run is not None
    if not clearance_joints(good.run):
        return ""
    largest = largest_forces(good.run)
    return max(largest, key=lambda name: largest[name])
