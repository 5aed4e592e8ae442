"""Reader of the configuration of a saved run: it makes descriptions and executes nothing that a file names."""

from __future__ import annotations

import copy
import itertools
import math
import random
import re
import sys
import tomllib
import typing
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import xarray as xr
from tests.build import EXAMPLES

import scissordyn as sd
from scissordyn.casefile.configuration import read_configuration, write_configuration
from scissordyn.casefile.quantity import unit_factor
from scissordyn.casefile.table import toml
from scissordyn.compiler import c
from scissordyn.config.schema import schema
from scissordyn.model.record import to_plain

FILES = sorted(EXAMPLES.glob("*.toml"))  # Case files of all examples

# Python file with user-defined laws
LAWS = """
import scissordyn as sd


@sd.element(slot="stiffness")
def soft(indentation, stiffness):
    return stiffness * indentation


@sd.element(slot="stiffness")
def other(indentation, stiffness):
    return 2.0 * stiffness * indentation
"""


def written(tree: Mapping[str, Any]) -> str:
    """Return a document as TOML, each table on one line."""
    return "\n".join(f"{toml(str(key))} = {toml(value)}" for key, value in tree.items())


def dataset(text: str | Mapping[str, Any], title: str = "scissordyn run") -> xr.Dataset:
    """Return a saved run with attributes only."""
    return xr.Dataset(attrs={"title": title, "configuration": text if isinstance(text, str) else written(text)})


def number(dice: random.Random) -> float:
    """Draw a positive number, often one that has no short decimal."""
    return dice.choice([dice.uniform(1e-3, 1e3), 10.0 ** dice.uniform(-3.0, 3.0), 0.1 / 3.0, 5e-4, math.pi, 1e-9, 0.25])


def signed(dice: random.Random) -> float:
    """Draw a number of either sign, or one of both zeros."""
    return number(dice) * dice.choice([1.0, -1.0, 0.0, -0.0])


def place(dice: random.Random) -> tuple[float, float]:
    """Draw a position."""
    return signed(dice), signed(dice)


def word(dice: random.Random) -> str:
    """Draw the name of a part from all characters that a case file may have, those with a meaning in TOML more often."""
    special = [*map(chr, range(33)), *"\"'\\#=[]{}.,/\x7f\x80\x85\u2028\ufeff\uffff", "\U0010ffff"]
    draws = (
        lambda: dice.choice(special),
        lambda: chr(dice.randrange(33, 127)),
        lambda: chr(dice.choice([dice.randrange(0xD800), dice.randrange(0xE000, 0x110000)])),
    )
    name = "".join(dice.choice(draws)() for _ in range(dice.randint(1, 8)))
    return word(dice) if name == "ground" or name.endswith("\0") else name


def chain(dice: random.Random) -> sd.Mechanism:
    """Draw a chain of bodies with any names, points and values, joints with clearance, a spring and a motion."""
    names = list(dict.fromkeys(word(dice) for _ in range(dice.randint(3, 5))))
    bodies = []
    for name in names:
        position, angle, mass = place(dice), signed(dice), number(dice)
        if dice.random() < 0.5:
            length = max(number(dice), 1e-5)  # with an inertia that a body may have
            bodies.append(sd.bar(name, length=length, mass=mass, position=position, angle=angle))
        else:
            points = {"start": place(dice), "end": place(dice), word(dice): place(dice)}
            bodies.append(sd.Body(name, mass, number(dice), points=points, centre=place(dice), position=position))
    damping = sd.Flores(dice.uniform(0.1, 0.9))
    gap = sd.Clearance(dice.uniform(1e-5, 1e-3), damping=damping, friction=sd.NoFriction())
    pins = [sd.Revolute("first", (names[0], "start"), ("ground", "O"))]
    for k, (one, other) in enumerate(itertools.pairwise(names)):
        pins.append(sd.Revolute(f"pin {k}", (one, "end"), (other, "start"), dice.choice([None, gap])))
    spring = sd.Spring(word(dice), (names[0], "end"), ("ground", "O"), number(dice), free_length=number(dice))
    functions = (
        lambda: sd.ConstantSpeed(signed(dice)),
        lambda: sd.Polynomial(tuple(signed(dice) for _ in range(dice.randint(1, 6)))),
        lambda: sd.Cycloidal(signed(dice), signed(dice), number(dice)),
    )
    ground = (("O", place(dice)),)
    mechanism = sd.Mechanism(tuple(bodies), tuple(pins), ground=ground, components=(spring,), gravity=number(dice))
    return mechanism.driven(dice.choice(functions)(), body=names[0])


def exact(plain: Any) -> Any:
    """Return plain data with every number as text, so that equality is exact."""
    if isinstance(plain, dict | list):
        return {key: exact(value) for key, value in (plain.items() if isinstance(plain, dict) else enumerate(plain))}
    return repr(float(plain)) if isinstance(plain, int | float) else plain


@pytest.mark.parametrize("seed", range(60))
def test_random_mechanisms(seed):
    """Identity: a mechanism, its case file, and the mechanism read from it are the same to the last bit."""
    mechanism = chain(random.Random(seed))
    text = write_configuration(mechanism)
    again = read_configuration(dataset(text)).build_mechanism()
    assert again == mechanism
    assert exact(to_plain(again)) == exact(to_plain(mechanism))
    assert write_configuration(again) == text


@pytest.mark.parametrize("which", [*FILES, *sd.zoo], ids=lambda which: getattr(which, "stem", which))
def test_examples_and_the_zoo(which, tmp_path):
    """Identity: every mechanism with its laws, controllers and run options is read back to the last bit."""
    case = sd.zoo[which].case if isinstance(which, str) else sd.read_case(which)
    text = write_configuration(case.mechanism, case.run)
    found = read_configuration(dataset(text))
    assert found.build_mechanism() == case.mechanism
    assert exact(to_plain(found.build_mechanism())) == exact(to_plain(case.mechanism))
    assert found.options == case.run
    (tmp_path / "again.toml").write_text(text, encoding="utf-8")
    assert sd.read_case(tmp_path / "again.toml").mechanism == case.mechanism


@pytest.fixture
def own_run(array, tmp_path):
    """Return a saved run with a law in a user's file."""
    file = tmp_path / "laws.py"
    file.write_text(LAWS)
    law = sd.law("stiffness", f"{file}:soft")(1e8)
    run = sd.simulate(array.with_clearance("A", sd.Clearance(0.5e-3, stiffness=law)), until=0.003, samples=4)
    return sd.load(sd.save(run, tmp_path / "run.nc"))


def test_functions_of_the_user_need_consent(own_run, tmp_path):
    """Contract: a run with a law in a file is run again only from an allowed file with the same content."""
    file = tmp_path / "laws.py"
    with pytest.raises(sd.InputError, match=r"'soft' of 'laws.py'.*--allow-code laws.py"):
        sd.replay(own_run)
    moved = file.rename(tmp_path / "elsewhere.py")  # the place in the data file means nothing
    again = sd.replay(own_run, allow_code=moved)
    for name in own_run.variables:
        assert own_run[name].equals(again[name]), name
    edited = tmp_path / "edited.py"
    edited.write_text(LAWS.replace("2.0", "3.0"))
    with pytest.raises(sd.InputError, match="digest"):
        sd.replay(own_run, allow_code=[edited])
    assert len(sd.replay(own_run, allow_code=[edited, str(moved)])["time"]) == 4
    with pytest.raises(sd.InputError, match="does not exist"):
        sd.replay(own_run, allow_code=[tmp_path / "none.py"])


def test_function_without_a_digest_is_refused(own_run, tmp_path, monkeypatch):
    """Contract: an empty digest would fit any file; it is refused, whether files are allowed or not."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "x.py").write_text(f"open('done', 'w').write('')\n{LAWS}")
    tree = tomllib.loads(own_run.attrs["configuration"])
    (reference,) = tree["code"]
    assert re.fullmatch("[0-9a-f]{16}", tree["code"][reference])
    for law in (reference, "x.py:soft"):
        tree["clearance"][0]["stiffness"]["law"] = law
        for digest in ("", "0", None):
            tree["code"] = {} if digest is None else {law: digest}
            for allowed in ((), "x.py"):
                with pytest.raises(sd.InputError):
                    sd.replay(dataset(tree), allow_code=allowed)
    assert not (tmp_path / "done").exists()


def test_description_is_read_without_code(own_run):
    """Contract: analysis of a run reads the description without executing the user's functions."""
    mechanism = read_configuration(own_run).mechanism
    assert [joint.name for joint in mechanism.joints if joint.clearance is not None] == ["A"]
    assert mechanism.joints[1].clearance.clearance == 0.5e-3
    assert mechanism.drives[0].body == "unit 1/bar 1"
    assert mechanism.gravity == 9.81
    assert mechanism.joints[1].clearance.stiffness.name == "soft"
    assert sd.contact_statistics(own_run).attrs["arc_frame"] == "bearing"


def test_only_runs_are_run_again(array):
    """Contract: a map or diagram is not run again as a run."""
    text = write_configuration(array, sd.Options(0.4))
    with pytest.raises(sd.InputError, match="scissordyn cycles"):
        sd.replay(xr.Dataset(attrs={"title": "scissordyn cycles", "configuration": text}))
    with pytest.raises(sd.InputError, match="attribute 'configuration'"):
        sd.replay(xr.Dataset(attrs={"title": "scissordyn run"}))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[]", "not valid TOML"),
        ("", "the attribute 'configuration' is empty"),
        ("structure = 3", "structure = 3: not a table"),
        ('[structure]\nkind = "model.body.Body"', "unknown kind of structure"),
        ('[structure]\nkind = "mechanism"\nbodys = 1', "unknown key 'bodys' (did you mean"),
        ('[structure]\nkind = "mechanism"\ngravity = 9.81', "structure.gravity = 9.81: missing unit"),
        ('[structure]\nkind = "mechanism"\ngravity = true', "structure.gravity = true: not a number"),
        ('[[ground]]\nname = "O"\nposition = "0 m"\n[structure]\nkind = "mechanism"', "1 numbers"),
        ('[structure]\nkind = "mechanism"\n[diagram]\nover = []', "not a table of texts and numbers"),
        ('[structure]\nkind = "mechanism"\n[cod]\nx = "y"', "unknown key 'cod' (did you mean 'code'?)"),
        ('[structure]\nkind = "mechanism"', "body"),
        ('[structure]\nkind = "scissor"\n[drive]\ntable = "/etc/passwd"', "a saved run names a data file"),
        ('[structure]\nkind = "scissor"\n[control]\nfeed_forward = "ideal"', "a run contains the table [[control]]"),
        ('{"mechanism": {}}', "is not valid TOML"),
    ],
)
def test_invalid_configurations(text, says):
    """Contract: the error names the place and its content."""
    with pytest.raises(sd.InputError) as caught:
        read_configuration(dataset(text)).build_mechanism()
    assert says in str(caught.value)


def test_points_may_have_any_name():
    """Identity: a run keeps points whose names do not fit "BODY.POINT", and names with half a surrogate pair."""
    body = sd.Body("b", 1.0, 0.1, points={"kind": (1.0, 2.0), "a.b, c": (0.0, 0.0), "[x]\n[run]": (3.0, 0.0)})
    pins = sd.Revolute("pin", ("b", "a.b, c"), ("ground", "O.1"))
    tracks = (sd.Track("tip", "b", "a.b, c"), sd.Track("place", "b", (0.1, 0.2)))
    mechanism = sd.Mechanism((body,), (pins,), ground=(("O.1", (0.0, 0.0)),), tracks=tracks)
    text = write_configuration(mechanism, sd.Options(1.0))
    assert read_configuration(dataset(text)).build_mechanism() == mechanism
    assert read_configuration(dataset(text)).mechanism_text == write_configuration(mechanism).rstrip()


def test_digest_of_a_function_has_its_closure():
    """Contract: values that a Python function refers to are part of its digest."""

    def made(factor: float) -> Callable[..., Any]:
        @sd.element(slot="stiffness")
        def law(indentation: float) -> float:
            return factor * indentation

        return law

    def digest(factor: float) -> str:
        text = write_configuration(sd.scissor().with_clearance("A", sd.Clearance(1e-4, stiffness=made(factor)())))
        return tomllib.loads(text)["code"].popitem()[1]

    assert digest(2.0) == digest(2.0) != digest(3.0)


# -- tampered files --------------------------------------------------------------------------------------------------------


def compiles() -> bool:
    """Return whether the compiler or the evaluation of the package's annotations is running."""
    frame = sys._getframe()
    while frame is not None and frame.f_code.co_filename not in (c.__file__, typing.__file__):
        frame = frame.f_back
    return frame is not None


class Watch:
    """Record of forbidden audit events of the interpreter while a configuration is read."""

    FORBIDDEN = re.compile(
        r"exec|import|subprocess\..*|os\.(system|exec|posix_spawn|fork|remove|rename|mkdir|rmdir|truncate|link|symlink|chmod).*"
        r"|shutil\..*|socket\..*|ctypes\.dlopen|tempfile\..*|pickle\..*"
    )
    INSTALLED = False
    active: Watch | None = None

    def __init__(self) -> None:
        self.offences: list[str] = []
        if not Watch.INSTALLED:
            sys.addaudithook(Watch.hear)
            Watch.INSTALLED = True

    @staticmethod
    def hear(event: str, arguments: tuple[Any, ...]) -> None:
        """Record an event that a description must not cause."""
        watch = Watch.active
        if watch is None:
            return
        writes = event == "open" and any(letter in str(arguments[1] or "") for letter in "wax+")
        strange = event == "open" and "passwd" in str(arguments[0])
        if strange or ((writes or Watch.FORBIDDEN.fullmatch(event)) and not compiles()):
            watch.offences.append(f"{event} {arguments!r}"[:200])

    @contextmanager
    def watching(self) -> Iterator[None]:
        """Record events inside the block."""
        Watch.active = self
        try:
            yield
        finally:
            Watch.active = None


NAMES = (
    "os.system",
    "builtins.exec",
    "x.py:soft",
    "../../x.py:f",
    "file.py:__import__",
    "/dev/stdin:f",
    "class Soft",
    "liu",
    "mechanism",
)
"""Values that replace a name in a tampered file."""


def nodes(tree: Any, parent: Any = None, key: Any = None) -> Iterator[tuple[Any, Any]]:
    """Yield every place in a document as (container, key)."""
    if parent is not None:
        yield parent, key
    for inner in tree if isinstance(tree, dict) else range(len(tree)) if isinstance(tree, list) else ():
        yield from nodes(tree[inner], tree, inner)


def tampered(text: str, dice: random.Random) -> str:
    """Return a document with one to four changes."""
    tree = tomllib.loads(text)
    values: list[Callable[[], Any]] = [
        lambda: dice.choice([True, 0, -1, 1e308, 10**400, math.nan, math.inf, -0.0, 2**63]),
        lambda: dice.choice(["", "\x1b[2J", "1e999 m", "9^9^9^9 m", "1 m", *NAMES]),
        lambda: [[]] * dice.randrange(4),
        lambda: {"law": dice.choice(NAMES), "constants": [1.0]},
        lambda: {"type": dice.choice(NAMES), "name": "x"},
        lambda: {"table": dice.choice(["/etc/passwd", "mine.py"])},
    ]
    for _ in range(dice.randint(1, 4)):
        where, key = dice.choice(list(nodes({"": tree}))[1:])
        match dice.randrange(5):
            case 0 | 1:
                where[key] = dice.choice(values)()
            case 2:
                del where[key]
            case 3 if isinstance(where, dict):
                where[dice.choice(["law", "type", "name", "code", "component", "table", "x"])] = dice.choice(values)()
            case _:
                other, place = dice.choice(list(nodes({"": tree}))[1:])
                where[key] = copy.deepcopy(other[place])
    return written(tree) if tree else ""


@pytest.fixture(scope="module")
def originals(tmp_path_factory):
    """Return configurations of all examples, and of one with a user's law."""
    folder = tmp_path_factory.mktemp("laws")
    (folder / "laws.py").write_text(LAWS)
    own = sd.Clearance(0.5e-3, stiffness=sd.law("stiffness", f"{folder / 'laws.py'}:soft")(1e8))
    mechanisms = [*(sd.read_case(path).mechanism for path in FILES), sd.scissor(units=1).with_clearance("A", own)]
    return [write_configuration(one, sd.Options(0.01)) for one in mechanisms]


def read(run: xr.Dataset | Path, watch: Watch, offered: Path) -> bool:
    """Read a configuration as `replay` does, and return whether it was accepted; errors must be an `InputError` of one line."""
    try:
        found = sd.load(run) if isinstance(run, Path) else run
        with watch.watching():
            read_configuration(found).build_mechanism([offered])
    except sd.InputError as error:
        text = str(error)
        assert text
        assert text.isprintable()
        return False
    return True


@pytest.mark.parametrize("count", [250, pytest.param(1000, marks=pytest.mark.slow)])
def test_tampered_documents(originals, count, tmp_path, monkeypatch):
    """Contract: no tampered document makes the reader execute or write anything; errors have one line.

    One Python file lies where names could find it, and another one is allowed.
    """
    monkeypatch.chdir(tmp_path)
    Path("x.py").write_text(f"open('done', 'w').write('')\n{LAWS}")
    Path("mine.py").write_text("def mine(indentation):\n    return 1e8 * indentation\n")
    dice, watch = random.Random(20_240_607), Watch()
    # once beforehand: what is loaded and compiled with the first description is not the file's doing
    assert all(read(dataset(text), Watch(), Path("mine.py")) for text in originals[:-1])
    with pytest.raises(sd.InputError):
        unit_factor("slug", "kg")  # loads the library of units
    schema()  # evaluates the annotations of all tables
    accepted = sum(read(dataset(tampered(dice.choice(originals), dice)), watch, Path("mine.py")) for _ in range(count))
    assert not watch.offences, watch.offences[:5]
    assert not Path("done").exists()
    assert 0.02 * count < accepted < 0.5 * count  # some changes are harmless, most are not


def test_watch_notices_execution_and_writing():
    """Contract: executing code and writing files are recorded."""
    watch = Watch()
    with watch.watching():
        exec("1")
        open("/dev/null", "w").close()
    assert sorted(offence.split()[0] for offence in watch.offences) == ["exec", "open"]
