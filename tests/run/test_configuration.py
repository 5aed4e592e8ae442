"""The reader of what a saved run says of itself: it makes descriptions, and executes nothing that a file names."""

from __future__ import annotations

import json
import math
import pkgutil
import random
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from types import FrameType
from typing import Any

import h5py
import pytest
import xarray as xr

import scissordyn as sd
from scissordyn.compiler import c
from scissordyn.config.file import read_case
from scissordyn.control.catalogue import CONTROLLERS
from scissordyn.laws.catalogue import BY_KIND
from scissordyn.model import description, walk
from scissordyn.model.description import _alternatives, build, from_plain, parse
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.record import to_plain
from scissordyn.run.configuration import read_configuration, write_configuration
from scissordyn.run.options import Options
from scissordyn.run.simulate import replay, simulate
from scissordyn.run.store import load, save
from scissordyn.units import quantities

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.toml"))

LAWS = """
def soft(indentation, stiffness):
    return stiffness * indentation


def other(indentation, stiffness):
    return 2.0 * stiffness * indentation
"""


def dataset(plain: Any, title: str = "scissordyn run") -> xr.Dataset:
    """A saved run of which only the attributes matter."""
    return xr.Dataset(attrs={"title": title, "configuration": json.dumps(plain)})


def declared() -> set[type]:
    """Every class that may stand in the description of a run, found from the declarations."""
    found: set[type] = set()
    waiting: list[Any] = [Mechanism, Options]
    while waiting:
        for hint in _alternatives(waiting.pop()):
            if isinstance(hint, type) and hasattr(hint, "__dataclass_fields__"):
                if hint not in found:
                    found.add(hint)
                    waiting += [field.hint for field in walk.declared(hint).values()]
            else:
                waiting += [inner for inner in getattr(hint, "__args__", ()) if inner is not Ellipsis and inner != hint]
    return found


def test_every_example_survives(tmp_path: Path) -> None:
    """Identity: the mechanism of every example, written and read, is equal to itself; so are laws, controllers and options."""
    for path in EXAMPLES:
        case = read_case(path)
        options = Options(**case.run.keywords)
        text = write_configuration(case.mechanism, options)
        found = read_configuration(xr.Dataset(attrs={"configuration": text}))
        assert found.build_mechanism() == case.mechanism, path.name
        assert found.options == options
        assert to_plain(found.build_mechanism()) == found.plain


def test_what_may_be_described_is_what_is_declared() -> None:
    """Contract: the classes that the reader admits are dataclasses of descriptions; every law and controller is among them."""
    found = declared()
    assert {*CONTROLLERS.values(), *(law for known in BY_KIND.values() for law in known.values())} <= found
    assert {sd.Body, sd.Revolute, sd.Guide, sd.Spring, sd.Latch, sd.Harmonic, sd.Clearance, sd.UserElastic} <= found
    assert all(kind.__module__.split(".")[1] in ("model", "component", "laws", "control", "run") for kind in found)


INJECTED = 'p, x="""): return 0\n{}\ndef unused():\n    try: pass\n    #'
"""In the place of an argument's name: ends the function that is being written, executes something, begins another one."""

EVIL: dict[str, Callable[[Path], Any]] = {
    "code in the name of an argument": lambda folder: {
        "kind": "plugin.pointer.pointer_of",
        "kernel": {"kind": "jit.kernel"},
        "handed": [INJECTED.format(f"open({str(folder / 'done')!r}, 'w').write('')")],
        "targets": [],
    },
    "a file that is loaded": lambda folder: {
        "kind": "plugin.user_file.load_function",
        "reference": f"{folder / 'laws.py'}:soft",
    },
    "a file that is written": lambda folder: {
        "kind": "run.store.save",
        "run": {"kind": "run.store.load", "path": str(folder / "run.nc")},
        "path": str(folder / "done"),
    },
    "a module of another package": lambda folder: {"kind": "..os.system", "command": f"touch {folder / 'done'}"},
}


@pytest.mark.parametrize("way", EVIL)
def test_callables_that_a_file_names_are_not_called(way: str, tmp_path: Path) -> None:
    """Contract: a data file that names a function of the package in place of a description is refused, and nothing happens."""
    (tmp_path / "laws.py").write_text(f"open({str(tmp_path / 'done')!r}, 'w').write('')\n{LAWS}")
    save(dataset({"mechanism": {}}), tmp_path / "run.nc")
    evil = EVIL[way](tmp_path)
    for plain in ({"mechanism": evil}, {"mechanism": {"kind": "model.mechanism.Mechanism", "bodies": evil}}):
        with pytest.raises(sd.InputError):
            replay(dataset({**plain, "options": to_plain(Options(0.001))}))
    with pytest.raises(sd.InputError):
        replay(dataset({"mechanism": to_plain(sd.scissor(units=1)), "options": evil}))
    assert not (tmp_path / "done").exists()


@pytest.fixture
def own_run(array: Mechanism, tmp_path: Path) -> xr.Dataset:
    """A run with a law in a file of the user's own."""
    file = tmp_path / "laws.py"
    file.write_text(LAWS)
    law = sd.UserElastic(f"{file}:soft", (1e8,))
    run = simulate(array.with_clearance("A", sd.Clearance(0.5e-3, stiffness=law)), until=0.003, samples=4)
    return load(save(run, tmp_path / "run.nc"))


def test_functions_of_the_user_need_consent(own_run: xr.Dataset, tmp_path: Path) -> None:
    """Contract: a run with a law in a file is run again only from a file that is allowed and is what it was."""
    file = tmp_path / "laws.py"
    with pytest.raises(sd.InputError, match=r"'soft' of 'laws.py'.*--allow-code laws.py"):
        replay(own_run)
    moved = file.rename(tmp_path / "elsewhere.py")  # the place in the data file means nothing
    again = replay(own_run, allow_code=moved)
    for name in own_run.variables:
        assert own_run[name].equals(again[name]), name
    edited = tmp_path / "edited.py"
    edited.write_text(LAWS.replace("2.0", "3.0"))
    with pytest.raises(sd.InputError, match="digest"):
        replay(own_run, allow_code=[edited])
    assert len(replay(own_run, allow_code=[edited, str(moved)])["time"]) == 4
    with pytest.raises(sd.InputError, match="no file"):
        replay(own_run, allow_code=[tmp_path / "none.py"])


def test_a_function_without_a_digest_is_refused(own_run: xr.Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Contract: an empty digest would fit any file, such as one in the working folder; it is refused, allowed or not."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "x.py").write_text(f"open('done', 'w').write('')\n{LAWS}")
    plain = json.loads(own_run.attrs["configuration"])
    law = plain["mechanism"]["joints"][1]["clearance"]["stiffness"]
    assert re.fullmatch("[0-9a-f]{16}", law["digest"])
    for digest in ("", None, []):
        law |= {"function": "x.py:soft", "digest": digest}
        for allowed in ((), "x.py"):
            with pytest.raises(sd.InputError):
                replay(dataset(plain), allow_code=allowed)
    assert not (tmp_path / "done").exists()


def test_a_description_holds_the_digest_of_its_file(tmp_path: Path) -> None:
    """Contract: a law that names a file is that of the file's text when it was described, even if no digest is given."""
    file = tmp_path / "laws.py"
    file.write_text(LAWS)
    law = sd.UserElastic(f"{file}:soft", (1e8,))
    assert law.digest == sd.UserElastic(f"{file}:other", (1e8,)).digest != ""
    file.write_text(LAWS.replace("2.0", "3.0"))
    with pytest.raises(sd.InputError, match="has changed"):
        law.parameters(sd.Clearance(0.5e-3).surfaces)


def test_facts_are_read_without_code(own_run: xr.Dataset) -> None:
    """Contract: analysis of a run reads what it needs from the description, without executing the user's functions."""
    mechanism = read_configuration(own_run).mechanism
    assert [joint.name for joint in mechanism.joints if joint.clearance is not None] == ["A"]
    assert mechanism.joints[1].clearance.clearance == 0.5e-3
    assert mechanism.drives[0].body == "unit 1/bar 1"
    assert mechanism.gravity == 9.81
    assert sd.contact_statistics(own_run).attrs["arc_frame"] == "bearing"


def test_only_runs_are_run_again(array: Mechanism) -> None:
    """Contract: a map or a diagram has a configuration of its own, and is not taken for a run."""
    text = write_configuration(array, Options(0.4))
    with pytest.raises(sd.InputError, match="scissordyn cycles"):
        replay(xr.Dataset(attrs={"title": "scissordyn cycles", "configuration": text}))
    with pytest.raises(sd.InputError, match="attribute 'configuration'"):
        replay(xr.Dataset(attrs={"title": "scissordyn run"}))


@pytest.mark.parametrize(
    ("plain", "says"),
    [
        ([], "describes no mechanism"),
        ({}, "describes no mechanism"),
        ({"mechanism": 3}, "mechanism is 3"),
        ({"mechanism": {"kind": "model.body.Body"}}, "mechanism of kind 'model.body.Body'"),
        ({"mechanism": {"kind": "model.mechanism.Mechanism", "bodys": []}}, "mechanism has 'bodys'"),
        ({"mechanism": {"kind": "model.mechanism.Mechanism", "gravity": "9.81"}}, "mechanism.gravity is '9.81'"),
        ({"mechanism": {"kind": "model.mechanism.Mechanism", "gravity": True}}, "mechanism.gravity is True"),
        ({"mechanism": {"kind": "model.mechanism.Mechanism", "gravity": 10**400}}, "a huge number"),
        ({"mechanism": {"kind": "model.mechanism.Mechanism", "ground": [["O", [0.0]]]}}, "has 1 entries"),
        ({"mechanism": {"kind": "model.mechanism.Mechanism"}, "diagram": {"over": []}}, "diagram"),
        ({"mechanism": {"kind": "model.mechanism.Mechanism"}, "code": "x"}, "has 'code'"),
        ({"mechanism": {"kind": "model.mechanism.Mechanism"}}, "cannot be used"),
    ],
)
def test_what_is_no_configuration_is_named(plain: Any, says: str) -> None:
    """Contract: the message names the place and what stands there."""
    with pytest.raises(sd.InputError) as caught:
        read_configuration(dataset(plain)).build_mechanism()
    assert says in str(caught.value)


def test_points_may_have_any_name() -> None:
    """Contract: a mapping of names to points is data, whatever its names are."""
    body = sd.Body("b", 1.0, None, points={"kind": (1.0, 2.0), "function": (0.0, 0.0)})
    assert from_plain(to_plain(body), sd.Body) == body


def test_a_changed_function_is_another_description() -> None:
    """Contract: what a Python function refers to is part of its digest, not only its text."""

    def made(factor: float) -> Callable[[float], float]:
        def law(indentation: float) -> float:
            return factor * indentation

        return law

    same, other = to_plain(made(2.0)), to_plain(made(3.0))
    assert same == to_plain(made(2.0))
    assert (same["source"], same["name"]) == (other["source"], other["name"])
    assert same["digest"] != other["digest"]


# -- tampered files --------------------------------------------------------------------------------------------------------


def compiles() -> bool:
    """Whether the compiler works, on a function of a file that is allowed."""
    frame = sys._getframe()
    while frame is not None and frame.f_code.co_filename != c.__file__:
        frame = frame.f_back
    return frame is not None


class Watch:
    """What happens while a configuration is read: calls out of the reader, and events of the interpreter."""

    FORBIDDEN = re.compile(
        r"exec|import|subprocess\..*|os\.(system|exec|posix_spawn|fork|remove|rename|mkdir|rmdir|truncate|link|symlink|chmod).*"
        r"|shutil\..*|socket\..*|ctypes\.dlopen|tempfile\..*|pickle\..*"
    )
    INSTALLED = False
    active: Watch | None = None

    def __init__(self) -> None:
        self.offences: list[str] = []
        self.classes = declared()
        self.reader = description.__file__
        if not Watch.INSTALLED:
            sys.addaudithook(Watch.hear)
            Watch.INSTALLED = True

    @staticmethod
    def hear(event: str, arguments: tuple[Any, ...]) -> None:
        """Note what a description has no business to do."""
        watch = Watch.active
        if watch is None:
            return
        writes = event == "open" and any(letter in str(arguments[1] or "") for letter in "wax+")
        if (writes or Watch.FORBIDDEN.fullmatch(event)) and not compiles():
            watch.offences.append(f"{event} {arguments!r}"[:200])

    def profile(self, frame: FrameType, event: str, _: Any) -> None:
        """The reader calls itself, the standard library, errors, and the declared classes."""
        caller = frame.f_back
        if event != "call" or caller is None or caller.f_code.co_filename != self.reader:
            return
        file, name = frame.f_code.co_filename, frame.f_code.co_name
        made = frame.f_locals.get("self", next(iter(frame.f_locals.get("given", ())), None))  # by itself, or by `suggesting`
        if name in ("__init__", "suggested") and type(made) in self.classes | {description.NamedFunction, sd.InputError}:
            return
        inside = "/scissordyn/" in file
        readers = ("model/description.py", "model/record.py", "model/walk.py")
        allowed = (*readers, "annotation.py", "errors.py", "plugin/user_file.py")
        if (inside and not file.endswith(allowed)) or name in ("load_function", "_module", "pinned"):
            self.offences.append(f"call of {name} in {file}")

    @contextmanager
    def watching(self) -> Iterator[None]:
        """Note everything that happens meanwhile."""
        Watch.active = self
        sys.setprofile(self.profile)
        try:
            yield
        finally:
            sys.setprofile(None)
            Watch.active = None


def callables() -> list[str]:
    """Names of all functions and classes of the package, as a tampered file could write them."""
    found = []
    for room in (
        "model",
        "laws",
        "control",
        "plugin",
        "run",
        "study",
        "config",
        "mechanics",
        "integrate",
        "kernel",
        "errors",
    ):
        module = import_module(f"scissordyn.{room}")
        paths = getattr(module, "__path__", None)
        names = [entry.name for entry in pkgutil.walk_packages(paths, f"scissordyn.{room}.")] if paths else [module.__name__]
        for name in names:
            inside = vars(import_module(name))
            found += [f"{name.removeprefix('scissordyn.')}.{key}" for key, value in inside.items() if callable(value)]
    return [*found, "os.system", "subprocess.run", "builtins.eval", "builtins.exec", "builtins.open", "..os.system"]


def nodes(tree: Any, parent: Any = None, key: Any = None) -> Iterator[tuple[Any, Any]]:
    """Every place in a JSON document as (container, key)."""
    if parent is not None:
        yield parent, key
    for inner in tree if isinstance(tree, dict) else range(len(tree)) if isinstance(tree, list) else ():
        yield from nodes(tree[inner], tree, inner)


def tampered(plain: Any, names: list[str], dice: random.Random) -> Any:
    """A JSON document with one to four changes."""
    tree = json.loads(json.dumps(plain))
    values: list[Callable[[], Any]] = [
        lambda: None,
        lambda: dice.choice([True, 0, -1, 1e308, 10**400, math.nan, math.inf, -0.0, 2**63]),
        lambda: dice.choice(["", "\0", "\x1b[2J", "a\nb", "\ud800", "../../x.py:f", "x.py:soft", "file.py:__import__"]),
        lambda: [[]] * dice.randrange(4),
        lambda: {"kind": dice.choice(names)},
        lambda: {"kind": dice.choice(names), "function": "x.py:soft", "path": "done", "digest": ""},
        lambda: {"kind": "function", "name": "f", "source": "import os; os.system('touch done')"},
        lambda: json.loads("[" * 200 + "]" * 200),
    ]
    for _ in range(dice.randint(1, 4)):
        where, key = dice.choice(list(nodes({"": tree}))[1:])
        match dice.randrange(6):
            case 0 | 1:
                where[key] = dice.choice(values)()
            case 2:
                del where[key]
            case 3 if isinstance(where, dict):
                where[dice.choice(["kind", "function", "__class__", "__init__", "digest", "self", "x"])] = dice.choice(values)()
            case 4 if isinstance(where, dict) and "kind" in where:
                where["kind"] = dice.choice(names)
            case _:
                other, place = dice.choice(list(nodes({"": tree}))[1:])
                where[key] = json.loads(json.dumps(other[place]))
    return tree


@pytest.fixture(scope="module")
def originals(tmp_path_factory: pytest.TempPathFactory) -> list[Any]:
    """Configurations of all examples, and of one with laws of the user's own."""
    folder = tmp_path_factory.mktemp("laws")
    (folder / "laws.py").write_text(LAWS)
    own = sd.Clearance(0.5e-3, stiffness=sd.UserElastic(f"{folder / 'laws.py'}:soft", (1e8,)))
    mechanisms = [*(read_case(path).mechanism for path in EXAMPLES), sd.scissor(units=1).with_clearance("A", own)]
    return [{"mechanism": to_plain(one), "options": to_plain(Options(0.01))} for one in mechanisms]


def read(run: xr.Dataset | Path, watch: Watch, offered: Path) -> bool:
    """Read a configuration as `replay` does; whether it was accepted. Anything but an `InputError` of one line is raised."""
    try:
        found = load(run) if isinstance(run, Path) else run
        with watch.watching():
            read_configuration(found).build_mechanism([offered])
    except sd.InputError as error:
        text = str(error)
        assert text
        assert text.isprintable()
        return False
    return True


@pytest.mark.parametrize("count", [250, pytest.param(1000, marks=pytest.mark.slow)])
def test_tampered_documents(originals: list[Any], count: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Contract: of so many tampered documents none makes the reader call anything but a declared class; errors are of one line.

    A Python file lies where names could find it, and another one is allowed.
    """
    monkeypatch.chdir(tmp_path)
    Path("x.py").write_text(f"open('done', 'w').write('')\n{LAWS}")
    Path("mine.py").write_text("def mine(indentation):\n    return 1e8 * indentation\n")
    for kind in declared():
        quantities(kind)  # evaluates annotations when first asked for
    names, dice, watch = callables(), random.Random(20_240_607), Watch()
    assert len(names) > 500
    # once beforehand: what is loaded and compiled with the first description is not the file's doing
    assert all(read(dataset(plain), Watch(), Path("mine.py")) for plain in originals[:-1])
    accepted = sum(read(dataset(tampered(dice.choice(originals), names, dice)), watch, Path("mine.py")) for _ in range(count))
    assert not watch.offences, watch.offences[:5]
    assert not Path("done").exists()
    assert 0.02 * count < accepted < 0.5 * count  # some changes are harmless, most are not


def test_the_watch_sees_what_it_should() -> None:
    """Contract: executing, writing, starting a process and calling a function of the package are noticed."""
    watch = Watch()
    with watch.watching():
        exec("1")
        open("/dev/null", "w").close()
        description.parse.__globals__["kind_of"](Options)
        build(parse(to_plain(Options(1.0)), Options))
    assert sorted(offence.split()[0] for offence in watch.offences) == ["exec", "open"]


def test_tampered_files(originals: list[Any], array: Mechanism, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Contract: the same for 40 NetCDF files whose attributes, title or length were changed."""
    monkeypatch.chdir(tmp_path)
    whole = save(simulate(array, until=0.001, samples=3), "whole.nc").read_bytes()
    names, dice, watch, file = callables(), random.Random(7), Watch(), Path("run.nc")
    Path("mine.py").write_text("def mine(indentation):\n    return 1e8 * indentation\n")
    read(dataset(originals[0]), Watch(), Path("mine.py"))
    for index in range(40):
        file.write_bytes(whole)
        with h5py.File(file, "r+") as stored:
            match index % 4:
                case 0 | 1:
                    changed = json.dumps(tampered(dice.choice(originals), names, dice))
                    stored.attrs["configuration"] = changed.replace("\\ud800", "?")
                case 2:
                    stored.attrs["configuration"] = dice.choice([3, [1.0, 2.0], b"\xff\xfe", "{", "[" * 100_000, "null"])
                case _:
                    stored.attrs[dice.choice(["title", "configuration"])] = dice.choice(["", "title", "3"])
        if index % 8 == 7:
            file.write_bytes(whole[: dice.randrange(len(whole))])
        read(file, watch, Path("mine.py"))
    assert not watch.offences, watch.offences[:5]
