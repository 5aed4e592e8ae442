"""Handle one open page: the messages from its session, its requests, and the files that it saves."""

from __future__ import annotations

import json
import logging
import math
import tempfile
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scissordyn.errors import InputError, ScissordynError
from scissordyn.explore.answers import CURRENT_COLOUR, PINNED_COLOURS, cards, contact_table, curves_as_csv, differences, figures
from scissordyn.explore.case import python_of
from scissordyn.explore.influence import Influence, Influences, Order, measures
from scissordyn.explore.session import Outcome, Session
from scissordyn.plan.bending import bends
from scissordyn.plot.canvas import pack_run
from scissordyn.plot.series import largest_forces
from scissordyn.record.joint_force import clearance_joints
from scissordyn.record.results import Run
from scissordyn.record.warn import warnings_of
from scissordyn.units import short
from scissordyn.warning import group, line

if TYPE_CHECKING:
    from scissordyn.explore.drag import Drag
    from scissordyn.model.mechanism import Mechanism

INTERNAL_ERROR = "internal error: see the terminal of the explorer"  # Message of the page about an unexpected exception

AUTO = "auto"  # Value of the option that chooses a magnification with visible deflections
MAGNIFICATION_MAX = 1e6  # Largest magnification of deflections in the drawing
MAGNIFICATION_STEPS = (1.0, 2.0, 5.0)  # Automatic magnifications of deflections are these values times a power of ten


FILE_TYPES = {
    "case": ("toml", "text/plain"),
    "run": ("nc", "application/x-netcdf"),
    "curves": ("csv", "text/csv"),
    "picture": ("svg", "image/svg+xml"),
    "film": ("html", "text/html"),
}
"""File ending and MIME type of each kind of file that the page can save."""

_slots = threading.BoundedSemaphore(2)  # acquired while a file is created

log = logging.getLogger(__name__)

Message = Mapping[str, Any]


class Page:
    """Open page with its session, used by one thread at a time; `send` sends a message to page.js."""

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
        self._weighed: Sequence[str] = ()  # Numbers whose influence is wanted, and the one whose tangents are wanted
        self._traced = ""
        self._influence: Influence | None = None
        self._influences = Influences(self._take_influence)
        self._answering: dict[str, Callable[[Message], object]] = {
            "change": lambda of: session.change(
                {read_text(of, "key"): read_text(of, "text")}, final=bool(of.get("final", True))
            ),
            "select": self._select,
            "influence": self._weigh,
            "drawn": lambda of: self._drawn(read_integer(of, "run")),
            "horizon": lambda of: session.open(session.case.with_horizon(bool(of.get("wanted")))),
            "magnify": self._magnify,
            "drag": self._dragged,
            "pin": self._pin,
            "python": lambda of: self.send({"type": "python", "text": python_of(session.case)}),
            "axis": lambda of: self._show_points(read_text(of, "name")),
            "open": self._open,
            "undo": lambda of: session.undo(),
            "redo": lambda of: session.undo(again=True),
            "unpin": lambda of: session.pin(),
            "stop": lambda of: session.worker.stop(),
            **dict.fromkeys(FILE_TYPES, self._save),
        }

    def begin(self) -> None:
        """Send the fields of the case and the available results of its run."""
        with self._lock:
            self.session.updated = self._updated
            if self.session.opened.points is not None:
                self._show_points(self.session.opened.points.axes[0])
            for what in ("fields", "status", "run"):
                self._updated(what)

    def close(self) -> None:
        """End the page and its worker."""
        self.session.worker.close()
        self._influences.cancel()

    # messages from the session, also from its thread

    def _updated(self, what: str) -> None:
        with self._lock:
            if what == "fields":
                case, folded = self.session.case, self.session.opened.points is not None
                about = {"wrong": self.session.wrong, "chosen": dict(case.chosen), "folded": folded}
                self.send({"type": "form", "fields": [field.plain() for field in case.fields.values()], **about})
            elif what == "pins":
                self._publish(pins=True)
            elif what == "fine":
                if self.session.good is self.shown and self.shown is not None and self.shown.fine is not None:
                    self._publish()  # otherwise the curves are sent together with the run
                self._order_influence()
            elif what == "run":
                self._show_run()
            elif what == "status" and self.drag is None and not self.session.computing and self.session.message:
                self.send({"type": "draft", "draft": ""})  # the dragged mechanism cannot be run
            if self.session.computing:
                self._influences.cancel()
            if what != "fine":
                self._show_state()

    # the shown run: one message contains the whole run, and the next one is sent after the browser has drawn it

    def _show_run(self) -> None:
        """Send the newest run, unless the browser is still drawing the previous one."""
        good = self.session.good
        if good is None or good.run is None or good is self.shown or self._drawing:
            return
        self.shown, self._drawing = good, True
        if self.selected not in clearance_joints(good.run):
            largest = largest_forces(good.run) or {"": 0.0}
            self.selected = max(largest, key=lambda name: largest[name])
        self._publish(scene=True)

    def _drawn(self, run: int) -> None:
        if self.shown is not None and self.shown.number == run:
            self._drawing = False
            self.session.worker.drawn(run)
            self._show_run()
            self._show_state()

    def _publish(self, *, scene: bool = False, pins: bool = False) -> None:
        """Send the shown run with its number as one message."""
        if self.shown is None or self.shown.run is None or self.shown.curves is None:
            return
        run, mechanism, pinned = self.shown.run, self.shown.case.mechanism, self.session.pins
        summary, before = self.shown.summary, [pin.run for pin in pinned if pin.run is not None]
        tangent = None
        if self._influence is not None and self._influence.order.outcome is self.shown:
            tangent = self._influence.tangent(self.shown.curves)
        message: dict[str, Any] = {
            "type": "run",
            "run": self.shown.number,
            "bar": self._bar(self.shown, run, tangent.label if tangent else ""),
            "cards": list(cards(summary)),
            "measures": list(measures(summary, mechanism).items()),
            **figures(self.shown.curves, summary, before, self.selected, mechanism.output_body, tangent),
        }
        if scene:
            message |= {
                "scene": self._scene(self.shown, run),
                "table": contact_table(run),
                "bends": bends(mechanism),
                "selected": self.selected,
            }
        if pins:
            message["ghost"] = pack_run(before[-1], pinned[-1].case.mechanism) if before else ""
        self.send(message)

    def _bar(self, shown: Outcome, run: Run, tangent: str) -> dict[str, Any]:
        """Return the contents of the status bar for a run; `tangent` is the label of its bands, or ""."""
        statistics = json.loads(run.attrs["statistics"])
        pins = self.session.pins[::-1]
        duration = f"computed in {short(statistics['seconds'], 's')}"
        values = differences([shown.case, *(pin.case for pin in pins)]) if pins else []
        legend = [[CURRENT_COLOUR, "solid", f"now: {values[0]}"]] if pins else []
        legend += [[color, "dash", f"pinned: {text}"] for color, text in zip(PINNED_COLOURS, values[1:], strict=False)]
        legend += [[CURRENT_COLOUR, "band", tangent]] if tangent else []
        return {
            "note": shown.note,
            "fine": shown.fine is not None,
            "text": f"{shown.note}: {duration}" if shown.note else duration,
            "detail": f"{statistics['steps']} steps of {statistics['method']}",
            "pins": len(pins),
            "legend": legend,
            "warnings": [line(alike) for alike in group(warnings_of(run))],
        }

    def _factor(self, shown: Outcome) -> float:
        """Return the magnification of deflections in the scene of a run; 1.0 for preliminary runs."""
        if shown.run is None or shown.note or self._wish == 1.0:
            return 1.0
        return magnification_of(self._wish, shown.run, shown.case.mechanism)

    def _scene(self, shown: Outcome, run: Run) -> str:
        """Return the scene of a run; magnified deflections are computed in a thread and sent later."""
        factor = self._factor(shown)
        if self._larger is not None and self._larger[0] == (shown.number, factor):
            return self._larger[1]
        if factor != 1.0 and not self._enlarging:  # otherwise it is requested again after the current computation
            self._enlarging = True
            self._in_thread("magnifies", lambda: self._enlarge(shown, factor))
        return pack_run(run, shown.case.mechanism, number=shown.number)

    def _enlarge(self, shown: Outcome, factor: float) -> None:
        most_frames = 61  # each frame requires one assembly of the mechanism
        from scissordyn.equilibrium.deflection import magnified_deflection
        from scissordyn.record.sampling import spread_samples
        from scissordyn.record.xarray_dataset import as_dataset

        mechanism, run = shown.case.mechanism, shown.run
        assert run is not None
        frames = min(run.sizes["time"], most_frames)
        try:
            samples = spread_samples(run["time"].values, frames).tolist()
            larger = magnified_deflection(as_dataset(run), mechanism, factor, samples=samples)
            self._larger = (shown.number, factor), pack_run(larger, mechanism, number=shown.number, frames=frames)
        except BaseException:
            self._wish = 1.0
            raise
        finally:
            self._enlarging = False
        with self._lock:
            if self.drag is None:
                self._publish(scene=True)

    # the influence of numbers on the shown run, which is computed after the run

    def _weigh(self, message: Message) -> None:
        """Take the numbers whose influence is wanted, and the one that is drawn in the curves."""
        keys = message.get("keys")
        if not isinstance(keys, list) or not all(isinstance(key, str) for key in keys):
            raise InputError("'keys' in a message are not a list of texts", "keys of fields", "reload the page")
        self._weighed, self._traced = tuple(key for key in keys if key in self.session.case.fields), read_text(message, "drawn")
        self._order_influence()

    def _order_influence(self) -> None:
        shown = self.shown
        if not self._weighed:
            self._influences.cancel()
            self._take_influence(None)
        elif shown is not None and shown is self.session.good and not shown.note and not self.session.computing:
            self._influences.order(Order(shown, self._weighed, self._traced), self._influence)

    def _take_influence(self, influence: Influence | None) -> None:
        with self._lock:
            if influence is not None and influence.order is not self._influences.newest:
                return
            before, self._influence = self._influence, influence
            if influence is not None:
                self.send({"type": "influence", **influence.plain()})
            if any(shown is not None and shown.curves is not None for shown in (before, influence)):
                self._publish()

    # messages that do not concern a run

    def _show_points(self, axis: str) -> None:
        points = self.session.opened.points
        if points is None or axis not in points.axes:
            raise InputError(f"cannot draw the points over '{axis}'", "a varied parameter of the study")
        message = {"type": "points", "axes": list(points.axes), "axis": axis, "note": points.note}
        self.send({**message, "figures": points.figures(axis)})

    def _open(self, message: Message) -> None:
        points = self.session.opened.points
        if points is None:
            raise InputError("the case is not part of a study", "a case of a study or of a bifurcation diagram")
        self.session.open(points.case_at(read_integer(message, "point")))

    def _show_state(self) -> None:
        state = self.session.state()
        self.send({"type": "state", **state, "computing": state["computing"] or self.shown is not self.session.good})

    # messages from the browser

    def hear(self, content: str | bytes) -> None:
        """Answer a message from the browser; the reply to an invalid message is one line without traceback or paths."""
        try:
            message = json.loads(content) if isinstance(content, str) else None
        except (ValueError, RecursionError):
            message = None
        answer = self._answering.get(str(message.get("type"))) if isinstance(message, dict) else None
        if answer is None:
            self._send_error("unknown message")
            return
        with self._lock, self._in_one_line():
            answer(message)  # type: ignore[arg-type]

    @contextmanager
    def _in_one_line(self) -> Iterator[None]:
        """Within the block, show errors as one line on the page; internal errors are also logged in the terminal."""
        try:
            yield
        except ScissordynError as error:
            self._send_error(str(error))
        except Exception:
            log.exception(INTERNAL_ERROR)
            self._send_error(INTERNAL_ERROR)

    def _send_error(self, words: str) -> None:
        self.send({"type": "said", "text": words})

    def _in_thread(self, what: str, make: Callable[[], None]) -> None:
        """Run a task in a separate thread, because it takes seconds."""

        def work() -> None:
            with self._in_one_line():
                make()

        threading.Thread(target=work, name=f"scissordyn {what}", daemon=True).start()

    def _select(self, message: Message) -> None:
        joint = read_text(message, "name")
        if self.shown is not None and self.shown.run is not None and joint in clearance_joints(self.shown.run):
            self.selected = joint
            self._publish()

    def _pin(self, message: Message) -> None:
        if self.shown is not None and self.shown.run is not None:
            self.session.pin(replace(self.shown, run=self.shown.curves))

    def _save(self, message: Message) -> None:
        """Create a file: one at a time for this page, and at most two for all pages."""
        what, time = read_text(message, "type"), read_number(message, "time")
        if self._making:
            raise InputError(f"cannot make '{what}' while another file is being made", "one file at a time", "wait for it")
        if not _slots.acquire(blocking=False):
            raise InputError(f"cannot make '{what}' while other pages make two files", "two files at a time", "try again")
        self._making = True
        shown, joint = self.shown, self.selected
        magnify = 1.0 if shown is None else self._factor(shown)

        def make() -> None:
            try:
                name, mime, content = make_file(self.session, shown, what, time, joint, magnify)
                self.send({"type": "file", "name": name, "mime": mime, "content": content})
            finally:
                self._making = False
                _slots.release()

        self._in_thread("saves", make)

    def _magnify(self, message: Message) -> None:
        self._wish = read_magnification(message.get("factor"))
        self._publish(scene=True)

    def _dragged(self, message: Message) -> None:
        from scissordyn.explore.drag import Drag

        phase = read_text(message, "phase")
        try:
            if phase == "start":
                self.drag = None
                self.drag = Drag(self.session.case, read_text(message, "kind"), read_text(message, "name"))
                self._draft()
            elif self.drag is not None:
                self.drag.move_target(read_number(message, "dx"), read_number(message, "dy"), steps=2 if phase == "move" else 4)
                self._draft()
        except ScissordynError as error:
            self._send_error(str(error))
            if self.drag is not None:
                self._draft()
        if phase == "end" and self.drag is not None:
            texts, self.drag = self.drag.texts, None
            if not (texts and self.session.change(texts)):
                self.send({"type": "draft", "draft": ""})

    def _draft(self) -> None:
        """Send the dragged mechanism with a new number, which the browser waits for."""
        assert self.drag is not None
        self._answers += 1
        note = f"Drag: {self.drag.note}" if self.drag.note else "Drag"
        self.send({"type": "draft", "draft": pack_run(self.drag.run, self.drag.ideal, number=self._answers, note=note)})


def make_file(
    session: Session, shown: Outcome | None, what: str, time: float, joint: str, magnify: float
) -> tuple[str, str, bytes]:
    """Return name, MIME type and content of a file with the case, run, curves, picture or film that a page shows."""
    from scissordyn.plot.animation import animate  # imported here because it imports matplotlib
    from scissordyn.plot.file import svg
    from scissordyn.plot.still import structure
    from scissordyn.record.store import save

    end, mime = FILE_TYPES[what]
    name = f"{Path(session.opened.name).stem}.{end}"
    if what == "case":
        return name, mime, session.case.text().encode()
    if shown is None or shown.run is None or shown.curves is None:
        raise InputError("the page has no run yet", "a case that can be run")
    run, mechanism = shown.curves, shown.case.mechanism
    if what == "curves":
        return name, mime, curves_as_csv(run, shown.summary, joint, mechanism.output_body).encode()
    if what == "picture":
        instant = float(np.clip(time, 0.0, float(run["time"].values[-1])))
        return name, mime, svg(structure(run, mechanism, times=[instant], magnify=magnify)).encode()
    from scissordyn.record.xarray_dataset import as_dataset  # imports xarray, which the page itself does not need

    with tempfile.TemporaryDirectory(prefix="scissordyn-explore-") as folder:
        path = Path(folder) / f"run.{end}"
        whole = as_dataset(run)
        written = save(whole, path) if what == "run" else animate(whole, mechanism, path, magnify=magnify)
        return name, mime, written.read_bytes()


def read_text(message: Mapping[Any, Any], name: str) -> str:
    """Return a printable text of bounded length from a message."""
    longest = 200  # largest number of characters of a text from the browser
    value = message.get(name)
    if not isinstance(value, str) or len(value) > longest or not value.isprintable():
        raise InputError(f"'{name}' in a message is not a printable text", f"at most {longest} characters", "reload the page")
    return value


def read_number(message: Mapping[Any, Any], name: str) -> float:
    """Return a finite number from a message."""
    value = message.get(name)
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < math.inf or abs(value) > 1e300:
        raise InputError(f"'{name}' in a message is not a number", "a finite number", "reload the page")
    return float(value)


def read_integer(message: Mapping[Any, Any], name: str) -> int:
    value = read_number(message, name)
    if value != int(value):
        raise InputError(f"'{name}' in a message is not an integer", "an integer", "reload the page")
    return int(value)


def read_magnification(value: Any) -> float | str:
    """Return the requested magnification: "auto" or a number."""
    if value == AUTO:
        return AUTO
    if isinstance(value, bool) or not isinstance(value, int | float) or not 1.0 <= value <= MAGNIFICATION_MAX:
        raise InputError(f"magnification of deflections = {value!r}", f"'{AUTO}', 1 to {MAGNIFICATION_MAX:g}", AUTO)
    return float(value)


def magnification_of(wanted: float | str, run: Run, mechanism: Mechanism) -> float:
    """Return the magnification of deflections; 1.0 without flexible bars."""
    share = 0.05  # largest magnified deflection as a fraction of the mechanism's size
    if not bends(mechanism):
        return 1.0
    if isinstance(wanted, float):
        return wanted
    largest = float(np.abs(run["bar_largest_deflection"].values).max()) if "bar_largest_deflection" in run else 0.0
    room = share * mechanism.size / largest if largest > 0.0 else 1.0
    if not 1.0 < room < MAGNIFICATION_MAX:
        return MAGNIFICATION_MAX if room >= MAGNIFICATION_MAX else 1.0
    power = 10.0 ** math.floor(math.log10(room))
    return float(max(step * power for step in MAGNIFICATION_STEPS if step * power <= room * (1.0 + 1e-12)))
