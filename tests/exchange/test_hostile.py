"""Files that are damaged, have no end or are something else: one line and status 2, or a mechanism with its notes."""

import os
import random
import re

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.cli.main import status_of
from scissordyn.exchange.export import drawing
from scissordyn.exchange.source import SIZE_MAX

from .test_dxf_forms import drawn, plain, text
from .test_loops import CLOSINGS
from .test_loops import four_bar as four_bar_in_urdf
from .test_points import TABLE
from .test_robots import ARMS, STEP, tree
from .test_sdf import four_bars

# Numbers that replace a number of a file
NUMBERS = ("0", "-1", "1e400", "nan", "", "1e300", "-1e9", "1e-300", "999999999999999999999", "2147483648")
NUMBER = re.compile(r"-?\d+\.?\d*")  # Pattern of a number in a file


def altered(whole, draw):
    """Return the text with letters or a number replaced, or a part removed or repeated, at random positions."""
    kind = draw.randrange(4)
    first, last = sorted(draw.randrange(len(whole)) for _ in range(2))
    if kind == 0:
        return (
            whole[:first] + "".join(chr(draw.randrange(32, 0x2100)) for _ in range(draw.randrange(1, 5))) + whole[first + 1 :]
        )
    if kind == 1:
        found = draw.choice(list(NUMBER.finditer(whole)))
        return whole[: found.start()] + draw.choice(NUMBERS) + whole[found.end() :]
    return whole[:first] + whole[last:] if kind == 2 else whole[:last] + whole[first:last] + whole[last:]


def seeds():
    bodies, start = tree(np.random.default_rng(3))
    link = "?j=A,1.4,0.485,AB,R,t,0,0.1,t,%0AB,2,1,AB|BC,R,f,0,0,f%0AC,4,2,BC,R,t,0,0,f%0A&l=AB,1,1,0,0,A|B,%0ABC,1,1,0,0,B|C,"
    return [
        (sd.read_dxf, text(plain())),
        (sd.read_dxf, drawing(sd.four_bar(), pin_radius=2e-3)),
        (sd.read_mjcf, f"<mujoco><option gravity='0 0 -9.81' {STEP}/><worldbody>{bodies}</worldbody>{start}</mujoco>"),
        (sd.read_mjcf, ARMS.format("", "1.57 0 0", "0 0 1", "0 0 0", "0 0 1", "")),
        (sd.read_mjcf, four_bar_in_urdf(CLOSINGS["as in Drake"])),
        (sd.read_mjcf, four_bar_in_urdf(CLOSINGS["in degrees"])),
        (sd.read_mjcf, dict(four_bars())["relative poses and frames"]),
        (sd.read_points, TABLE),
        (sd.read_pmks, f"{link}&f=&s=10,false,false,m"),
    ]


@pytest.mark.parametrize("number", range(9))
def test_altered_files_are_one_line_or_a_mechanism(number, capfd):
    """Contract: no other error, no second line, nothing printed and no warning of Python."""
    read, whole = seeds()[number]
    draw = random.Random(number)
    for _ in range(12):
        try:
            said = read(altered(whole, draw)).notes
        except sd.InputError as error:
            said = (str(error),)
        assert not any("\n" in line for line in said)
    assert capfd.readouterr() == ("", "")


def test_what_the_library_says_is_a_note(capfd):
    """Contract: warnings of ezdxf and entities of other programs are notes."""
    document = plain()
    document.modelspace().add_text("mark")
    foreign = text(document).replace("TEXT\n", "RPOLYGON\n").replace("\nTABLES\n  0\nTABLE\n", "\nTABLES\n  0\nTABLE\n", 1)
    twice = re.sub(r"\n  5\n30\n", "\n  5\n2F\n", foreign)
    notes = sd.read_dxf(twice).notes
    assert any(note.startswith("ezdxf: Found non-unique entity handle") for note in notes)
    assert any(note.startswith("1 RPOLYGON left out: it is not a bar, pin or guide") for note in notes)
    assert capfd.readouterr() == ("", "")
    assert not any("ezdxf" in note for note in drawn(plain()).notes)


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.dxf", b"AutoCAD Binary DXF\r\n\x1a\0", "is a binary DXF; expected a DXF in ASCII"),
        ("a.dxf", b"AC1032\0\0", "is a DWG; expected a drawing in DXF"),
        ("a.csv", b"PK\x03\x04", "is a workbook or a ZIP archive"),
        ("a.ods", b"PK\x03\x04", "is a workbook"),
        ("a.csv", b"\xff\xfen", "is not valid utf-16"),
        ("a.xml", b"<?xml version='1.0' encoding='klingon'?><mujoco/>", "encoding 'klingon' of the file"),
        ("a.xml", b"<?xml version='1.0' encoding='ascii'?><mujoco model='\xe4'/>", "is not valid ascii"),
        ("a.csv", None, f"has more than {SIZE_MAX // 2**20} MiB"),
        ("a.pmks", b"?" + b"0." * 30_000, "the link of PMKS+ has more than 50000 characters"),
    ],
)
def test_files_of_other_kinds(name, content, said, tmp_path, capfd):
    """Contract: status 2 and one line that says what the file is."""
    path = tmp_path / name
    path.write_bytes(content or b"")
    if content is None:
        os.truncate(path, SIZE_MAX + 1)
    assert status_of(["import", str(path), "-o", str(tmp_path / "case.toml")]) == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert said in line


@pytest.mark.parametrize("path", ["/dev/zero", "/dev/urandom", "fifo", "."])
def test_what_has_no_end_is_not_read(path, tmp_path, capfd, monkeypatch):
    """Contract: devices, pipes and folders are refused before they are opened."""
    monkeypatch.chdir(tmp_path)
    os.mkfifo("fifo")
    assert status_of(["import", path, "-o", "case.toml"]) == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert f"cannot read '{path}': it is " in line


@pytest.mark.parametrize(
    ("version", "encoding", "layer"), [("R2000", "cp1251", "Опора"), ("R2000", "cp1252", "Träger"), ("R2010", "utf-8", "支持")]
)
def test_text_of_a_dxf_is_in_its_code_page(version, encoding, layer, tmp_path):
    """Identity: names of layers before AutoCAD 2007 and after it."""
    from .test_drawings import ezdxf

    document = ezdxf.new(version)
    document.header["$INSUNITS"] = 4
    document.encoding = encoding
    document.layers.add(layer).off()
    document.modelspace().add_line((0, 0), (1, 0))
    document.modelspace().add_line((0, 0), (0, 1), dxfattribs={"layer": layer})
    path = tmp_path / "a.dxf"
    path.write_bytes(text(document).encode(encoding))
    assert any(f"left out: layer '{layer}' is off" in note for note in sd.read_drawing(path).notes)
