"""One open page: the messages that it gets of its session, what it asks for, and the files that it saves."""

from __future__ import annotations

import json
import logging
import math
import tempfile
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scissordyn.errors import InputError, ScissordynError
from scissordyn.explore.answers import NOW, PINNED, cards, contact_table, curves_as_csv, differences, figures
from scissordyn.explore.case import python_of
from scissordyn.explore.session import Outcome, Session
from scissordyn.plan.bending import bends
from scissordyn.plot.canvas import packed_scene
from scissordyn.plot.series import largest_forces
from scissordyn.record.joint_force import clearance_joints
from scissordyn.record.warn import warnings_of
from scissordyn.units import short
from scissordyn.warning import group, line

if TYPE_CHECKING:
    import xarray as xr

    from scissordyn.explore.drag import Drag
    from scissordyn.model.mechanism import Mechanism

FAULT = "a fault of scissordyn: the terminal of the explorer says where"

AUTO = "auto"  # The magnification that makes deflections visible
LARGEST = 1e6  # Magnification
SHARE = 0.05  # The largest deflection, magnified, is at most this part of the size of the mechanism
STEPS = (1.0, 2.0, 5.0)  # Magnifications, times a power of ten
FRAMES = 61  # Of a drawing with magnified deflections: each needs the mechanism assembled with straight bars

LONGEST = 200  # Letters of a text from the browser: a number with its unit, or a name

SAVED = {
    "case": ("toml", "text/plain"),
    "run": ("nc", "application/x-netcdf"),
    "curves": ("csv", "text/csv"),
    "picture": ("svg", "image/svg+xml"),
    "film": ("html", "text/html"),
}
"""What is saved: the end of its name, and its type."""

MOST_MADE = 2  # Files that are made at the same time, by all pages together: each keeps a processor busy
_slots = threading.BoundedSemaphore(MOST_MADE)  # One is taken while a file is made

log = logging.getLogger(__name__)

Message = Mapping[str, Any]


class Page:
    """One open page with its session; what it does is done by one thread at a time. `send` takes messages, see page.js."""

    def __init__(self, session: Session, send: Callable[[Message], None]) -> None:
        self.session, self.send = session, send
        self.drag: Drag | None = None
        self.selected = ""
        self.shown: Outcome | None = None
        self._lock = threading.RLock()
        self._drawing = self._making = self._enlarging = False
        self._answers = 0
        self._wish: float | str = 1.0
        self._larger: tuple[tuple[int, float], str] | None = None
        self._answering: dict[str, Callable[[Message], object]] = {
            "change": lambda of: session.change({text(of, "key"): text(of, "text")}, final=bool(of.get("final", True))),
            "select": self._select,
            "drawn": lambda of: self._drawn(whole(of, "run")),
            "horizon": lambda of: session.open(session.case.with_horizon(bool(of.get("wanted")))),
            "magnify": self._magnify,
            "drag": self._dragged,
            "pin": self._pin,
            "python": self._python,
            "axis": lambda of: self._show_points(text(of, "name")),
            "open": self._open,
            "undo": lambda of: session.undo(),
            "redo": lambda of: session.undo(again=True),
            "unpin": lambda of: session.pin(),
            "stop": lambda of: session.worker.stop(),
            **dict.fromkeys(SAVED, self._save),
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
        self.session.worker.close()

    # what comes from the session, also from its thread

    def _updated(self, what: str) -> None:
        with self._lock:
            if what == "fields":
                case, folded = self.session.case, self.session.opened.points is not None
                about = {"wrong": self.session.wrong, "chosen": dict(case.chosen), "folded": folded}
                self.send({"type": "form", "fields": [field.plain() for field in case.fields.values()], **about})
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
            largest = largest_forces(good.run) if clearance_joints(good.run) else {"": 0.0}
            self.selected = max(largest, key=lambda name: largest[name])
        self._publish(scene=True)

    def _drawn(self, run: int) -> None:
        if self.shown is not None and self.shown.number == run:
            self._drawing = False
            self.session.worker.drawn(run)
            self._show_run()
            self._show_state()

    def _publish(self, *, scene: bool = False, pins: bool = False) -> None:
        """Send what is shown of the present run, with its number, as one message."""
        if self.shown is None or self.shown.run is None or self.shown.curves is None:
            return
        run, mechanism, pinned = self.shown.run, self.shown.case.mechanism, self.session.pins
        summary, before = self.shown.summary, [pin.run for pin in pinned if pin.run is not None]
        message: dict[str, Any] = {
            "type": "run",
            "run": self.shown.number,
            "bar": self._bar(self.shown, run),
            "cards": list(cards(summary)),
            **figures(self.shown.curves, summary, before, self.selected, mechanism.output_body),
        }
        if scene:
            message |= {
                "scene": self._scene(self.shown, run),
                "table": contact_table(self.shown.results or run),
                "bends": bends(mechanism),
                "selected": self.selected,
            }
        if pins:
            message["ghost"] = packed_scene(before[-1], pinned[-1].case.mechanism) if before else ""
        self.send(message)

    def _bar(self, shown: Outcome, run: xr.Dataset) -> dict[str, Any]:
        """What the bar says of a run."""
        statistics = json.loads(run.attrs["statistics"])
        pins = self.session.pins[::-1]
        steps = f"{statistics['steps']} steps of {statistics['method']} in {short(statistics['seconds'], 's')}"
        legend = differences([shown.case, *(pin.case for pin in pins)]) if pins else []
        return {
            "note": shown.note,
            "fine": shown.fine is not None,
            "text": f"{shown.note}: {steps}" if shown.note else steps,
            "pins": len(pins),
            "legend": [list(pair) for pair in zip((NOW, *PINNED), legend, strict=False)],
            "warnings": [line(alike) for alike in group(warnings_of(run))],
        }

    def _factor(self, shown: Outcome) -> float:
        """The magnification of the deflections of a run; runs that precede another have none."""
        if shown.run is None or shown.note or self._wish == 1.0:
            return 1.0
        return factor_of(self._wish, shown.run, shown.case.mechanism)

    def _scene(self, shown: Outcome, run: xr.Dataset) -> str:
        """The scene of a run; with magnified deflections when it has been made, in a thread."""
        factor = self._factor(shown)
        if self._larger is not None and self._larger[0] == (shown.number, factor):
            return self._larger[1]
        if factor != 1.0 and not self._enlarging:  # else it is asked for once more when the one before is there
            self._enlarging = True
            self._apart("magnifies", lambda: self._enlarge(shown, run, factor))
        return packed_scene(run, shown.case.mechanism, number=shown.number)

    def _enlarge(self, shown: Outcome, run: xr.Dataset, factor: float) -> None:
        from scissordyn.equilibrium.deflection import magnified_deflection
        from scissordyn.record.sampling import spread_samples

        mechanism, frames = shown.case.mechanism, min(run.sizes["time"], FRAMES)
        try:
            samples = spread_samples(run["time"].values, frames).tolist()
            larger = magnified_deflection(run, mechanism, factor, samples=samples)
            self._larger = (shown.number, factor), packed_scene(larger, mechanism, number=shown.number, frames=frames)
        except BaseException:
            self._wish = 1.0
            raise
        finally:
            self._enlarging = False
        with self._lock:
            if self.drag is None:
                self._publish(scene=True)

    # what is not of a run

    def _show_points(self, axis: str) -> None:
        points = self.session.opened.points
        if points is None or axis not in points.axes:
            raise InputError(f"points over '{axis}'", "the numbers of a study that vary")
        message = {"type": "points", "axes": list(points.axes), "axis": axis, "note": points.note}
        self.send({**message, "figures": points.figures(axis)})

    def _open(self, message: Message) -> None:
        points = self.session.opened.points
        if points is None:
            raise InputError("a point of a case that is no study", "a study or a bifurcation diagram")
        self.session.open(points.opened(whole(message, "point")))

    def _show_state(self) -> None:
        state = self.session.state()
        self.send({"type": "state", **state, "computing": state["computing"] or self.shown is not self.session.good})

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

    def _apart(self, what: str, make: Callable[[], None]) -> None:
        """Do what takes seconds in a thread."""

        def work() -> None:
            with self._in_one_line():
                make()

        threading.Thread(target=work, name=f"scissordyn {what}", daemon=True).start()

    def _select(self, message: Message) -> None:
        joint = text(message, "name")
        if self.shown is not None and self.shown.run is not None and joint in clearance_joints(self.shown.run):
            self.selected = joint
            self._publish()

    def _python(self, message: Message) -> None:
        self.send({"type": "python", "text": python_of(self.session.case)})

    def _pin(self, message: Message) -> None:
        if self.shown is not None and self.shown.run is not None:
            self.session.pin(replace(self.shown, run=self.shown.curves))

    def _save(self, message: Message) -> None:
        """Make a file: one at a time for this page, and few for all pages."""
        what, time = text(message, "type"), number(message, "time")
        if self._making:
            raise InputError(f"'{what}' is asked for while another file is being made", "one file at a time", "wait for it")
        if not _slots.acquire(blocking=False):
            raise InputError(
                f"'{what}' is asked for while {MOST_MADE} other pages make files", "two at a time", "try again soon"
            )
        self._making = True
        shown, joint = self.shown, self.selected
        magnify = 1.0 if shown is None else self._factor(shown)

        def make() -> None:
            try:
                name, mime, content = saved(self.session, shown, what, time, joint, magnify)
                self.send({"type": "file", "name": name, "mime": mime, "content": content})
            finally:
                self._making = False
                _slots.release()

        self._apart("saves", make)

    def _magnify(self, message: Message) -> None:
        self._wish = wish(message.get("factor"))
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
            if not (texts and self.session.change(texts)):
                self.send({"type": "draft", "draft": ""})

    def _draft(self) -> None:
        """Show what the drag has made; each answer differs from the one before, as the browser waits for it."""
        assert self.drag is not None
        self._answers += 1
        note = f"Drag: {self.drag.note}" if self.drag.note else "Drag"
        self.send({"type": "draft", "draft": packed_scene(self.drag.run, self.drag.ideal, number=self._answers, note=note)})


def saved(
    session: Session, shown: Outcome | None, what: str, time: float, joint: str, magnify: float
) -> tuple[str, str, bytes]:
    """A file of what a page shows: its name, type and content; nothing of it stays on the server's side."""
    from scissordyn.plot.animation import animate  # with matplotlib, which the page does not need
    from scissordyn.plot.file import svg
    from scissordyn.plot.still import structure
    from scissordyn.record.store import save

    end, mime = SAVED[what]
    name = f"{Path(session.opened.name).stem}.{end}"
    if what == "case":
        return name, mime, session.case.text().encode()
    if shown is None or shown.run is None or shown.curves is None:
        raise InputError("no run yet", "a case that can be run")
    run, mechanism = shown.curves, shown.case.mechanism
    if what == "curves":
        return name, mime, curves_as_csv(run, shown.summary, joint, mechanism.output_body).encode()
    if what == "picture":
        instant = float(np.clip(time, 0.0, float(run["time"].values[-1])))
        return name, mime, svg(structure(run, mechanism, times=[instant], magnify=magnify)).encode()
    with tempfile.TemporaryDirectory(prefix="scissordyn-explore-") as folder:
        path = Path(folder) / f"run.{end}"
        written = save(run, path) if what == "run" else animate(run, mechanism, path, magnify=magnify)
        return name, mime, written.read_bytes()


def text(message: Mapping[Any, Any], name: str) -> str:
    """A printable text of bounded length."""
    value = message.get(name)
    if not isinstance(value, str) or len(value) > LONGEST or not value.isprintable():
        raise InputError(f"a message of the page whose '{name}' is no text", f"at most {LONGEST} letters", "reload the page")
    return value


def number(message: Mapping[Any, Any], name: str) -> float:
    """A finite number."""
    value = message.get(name)
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < math.inf or abs(value) > 1e300:
        raise InputError(f"a message of the page whose '{name}' is no number", "a finite number", "reload the page")
    return float(value)


def whole(message: Mapping[Any, Any], name: str) -> int:
    """A whole number."""
    value = number(message, name)
    if value != int(value):
        raise InputError(f"a message of the page whose '{name}' is no whole number", "a whole number", "reload the page")
    return int(value)


def wish(given: Any) -> float | str:
    """A magnification as the page asks for it: "auto", or a number."""
    if given == AUTO:
        return AUTO
    if isinstance(given, bool) or not isinstance(given, int | float) or not 1.0 <= given <= LARGEST:
        raise InputError("magnification of deflections", f"'{AUTO}', 1 to {LARGEST:g}", AUTO)
    return float(given)


def factor_of(wanted: float | str, run: xr.Dataset, mechanism: Mechanism) -> float:
    """How many times deflections are drawn as large as they are; 1 without bars that bend."""
    if not bends(mechanism):
        return 1.0
    if isinstance(wanted, float):
        return wanted
    largest = float(abs(run["bar_largest_deflection"]).max()) if "bar_largest_deflection" in run else 0.0
    room = SHARE * mechanism.size / largest if largest > 0.0 else 1.0
    if not 1.0 < room < LARGEST:
        return LARGEST if room >= LARGEST else 1.0
    power = 10.0 ** math.floor(math.log10(room))
    return float(max(step * power for step in STEPS if step * power <= room * (1.0 + 1e-12)))
