"""Files of results: written completely or not at all, never over other files; and files that cannot be read as results."""

import os
import random
import signal
import stat
import sys

import h5py
import numpy as np
import pytest
import xarray as xr
from tests.build import EXAMPLES
from tests.process import Duplicate

import scissordyn as sd
from scissordyn.file import output_file
from scissordyn.file.checksum import checksum_line
from scissordyn.file.netcdf import NetcdfFile
from scissordyn.file.output_file import check_target, write_file
from scissordyn.record.results import Results
from scissordyn.record.store import write_results
from scissordyn.record.variable import Variable
from scissordyn.record.xarray_dataset import as_dataset
from scissordyn.run.simulate import compute_results


@pytest.fixture
def run():
    """Return a dataset of half a megabyte with the attributes of a run."""
    values = {"position": ("time", np.linspace(0.0, 1.0, 60_000)), "joint": ("joint", ["A", "B"])}
    return xr.Dataset(values, attrs={"title": "scissordyn run", "configuration": "{}"})


def save_with_limit(run, target, room):
    """Save a run although files may only have a given size."""
    import resource  # Windows has no such module

    resource.setrlimit(resource.RLIMIT_FSIZE, (room, room))
    try:
        sd.save(run, target)
    except sd.InputError as error:
        print(error)
        sys.exit(2)


@pytest.mark.parametrize("room", [0, 100_000])
def test_full_disk(run, tmp_path, room):
    """Contract: the error names the reason, the process continues, and the previous file stays."""
    target = tmp_path / "run.nc"
    small = sd.save(run.isel(time=slice(0, 2)), target).read_bytes()
    with Duplicate(save_with_limit, run, target, room) as other:
        out, err = other.communicate()
    assert (other.returncode, err) == (2, "")
    assert out.startswith(f"cannot write '{target}': File too large;")
    assert out.count("\n") == 1
    assert list(tmp_path.iterdir()) == [target]
    assert target.read_bytes() == small


def test_written_file_is_read_back(run, tmp_path):
    """Contract: a result is replaced by the next one, links are followed, and the user's permission mask is applied."""
    target, link = tmp_path / "run.nc", tmp_path / "link.nc"
    link.symlink_to(target)
    before = os.umask(0o027)
    try:
        assert sd.save(run, link) == link
    finally:
        os.umask(before)
    assert link.is_symlink()
    assert stat.S_IMODE(target.stat().st_mode) == 0o640
    xr.testing.assert_identical(sd.load(target), run)
    xr.testing.assert_identical(sd.load(sd.save(run.isel(time=slice(0, 5)), target)), run.isel(time=slice(0, 5)))


def test_permission_mask_is_not_changed(run, tmp_path, monkeypatch):
    """Contract: the permission mask is never changed, as it belongs to all threads."""

    def changed(_):
        raise AssertionError

    monkeypatch.setattr(os, "umask", changed)
    sd.save(run, tmp_path / "run.nc")


def test_texts_that_netcdf_cannot_hold(run, tmp_path):
    """Contract: a NUL in a name is stored as its code."""
    names = ["A\0B", "B", "é\x1b[31m"]
    named = run.drop_vars("joint").assign_coords(joint=("joint", np.array(names, dtype=object)))
    named["cause"] = ("joint", np.array([f"joint '{name}'" for name in names], dtype=object))
    named.attrs["cause"] = "joint 'A\0B'"
    found = sd.load(sd.save(named, tmp_path / "run.nc"))
    assert found["joint"].values.tolist() == [r"A\x00B", "B", "é\x1b[31m"]
    assert found["cause"].values[0] == r"joint 'A\x00B'"
    assert found.attrs["cause"] == r"joint 'A\x00B'"


def test_control_c_while_writing_loses_nothing(run, tmp_path, monkeypatch):
    """Contract: Ctrl-C takes effect once the file is complete."""
    flush, calls = os.fsync, []

    def interrupted(handle):
        calls.append(handle)
        if len(calls) == 1:
            raise KeyboardInterrupt
        flush(handle)

    monkeypatch.setattr(output_file.os, "fsync", interrupted)
    with pytest.raises(KeyboardInterrupt):
        sd.save(run, tmp_path / "run.nc")
    xr.testing.assert_identical(sd.load(tmp_path / "run.nc"), run)
    assert len(list(tmp_path.iterdir())) == 1


def write_without_end(path):
    """Write a file until this process is killed."""

    def stop(_):
        print("writing", flush=True)
        signal.pause()

    output_file.os.fsync = stop
    write_file(path, b"half")


def test_remains_of_killed_writers_are_removed(tmp_path):
    """Contract: a writer removes the remains of a killed writer of the same file, but not the file of an active one."""
    target = tmp_path / "run.nc"
    writers = [Duplicate(write_without_end, target) for _ in range(2)]
    for writer in writers:
        assert writer.stdout.readline() == "writing\n"
    assert len(list(tmp_path.glob(".*.part"))) == 2
    writers[0].kill()
    writers[0].communicate()
    write_file(target, b"whole")
    assert len(list(tmp_path.glob(".*.part"))) == 1
    writers[1].kill()
    writers[1].communicate()
    write_file(tmp_path / "other.nc", b"another file")
    assert len(list(tmp_path.glob(".*.part"))) == 1
    write_file(target, b"whole")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["other.nc", "run.nc"]
    assert target.read_bytes() == b"whole"


def test_other_files_are_not_overwritten(run, tmp_path):
    """Contract: texts, other HDF5 files, half a file, devices, pipes and folders are kept; an empty file is replaced."""
    with h5py.File(tmp_path / "foreign.nc", "w") as foreign:
        foreign["x"] = 1.0
    (tmp_path / "case.TOML").write_text("[structure]\n")
    (tmp_path / "half.nc").write_bytes(sd.save(run, tmp_path / "whole.nc").read_bytes()[:1000])
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link.nc").symlink_to("/dev/null")
    for name, says in (
        ("foreign.nc", "not a NetCDF file of scissordyn"),
        ("case.TOML", "not a NetCDF file of scissordyn"),
        ("half.nc", "not a NetCDF file of scissordyn"),
        ("pipe", "not a regular file"),
        ("link.nc", "not a regular file"),
        ("/dev/full", "not a regular file"),
        (".", "it is a folder"),
    ):
        target = tmp_path / name
        before = target.read_bytes() if target.is_file() else b""
        with pytest.raises(sd.InputError, match=says):
            sd.save(run, target)
        assert (target.read_bytes() if target.is_file() else b"") == before
    (tmp_path / "empty.nc").touch()
    sd.save(run, tmp_path / "empty.nc")
    sd.save(run, tmp_path / "whole.nc")
    sd.save(run, tmp_path / "half.nc", replace_broken=True)
    assert all(sd.load(tmp_path / name).equals(run) for name in ("empty.nc", "whole.nc", "half.nc"))


def test_dataset_without_a_title(tmp_path):
    """Contract: a saved dataset without a title can be saved again."""
    table = xr.Dataset({"x": ("n", [1.0, 2.0])})
    sd.save(table, tmp_path / "table.nc")
    sd.save(2.0 * table, tmp_path / "table.nc")
    assert sd.load(tmp_path / "table.nc")["x"].values.tolist() == [2.0, 4.0]


def test_pictures_replace_pictures_only(tmp_path):
    """Contract: a picture is replaced if the file begins as a picture of its format."""
    beginnings = {"png": b"\x89PNG\r\n\x1a\n", "gif": b"GIF89a", "svg": b"<?xml ", "mp4": b"\0\0\0 ftyp"}
    beginnings["html"] = b"<!DOCTYPE html>"
    for ending, begins in beginnings.items():
        target = tmp_path / f"picture.{ending}"
        target.write_bytes(begins + b" and so on")
        check_target(target)
        target.write_text("[structure]\n")
        with pytest.raises(sd.InputError, match="not overwritten"):
            check_target(target)


def test_devices_and_pipes_are_not_read(tmp_path):
    """Contract: a device and a pipe without a writer are refused at once."""
    os.mkfifo(tmp_path / "pipe")
    for path in ("/dev/zero", tmp_path / "pipe"):
        with pytest.raises(sd.InputError, match="not a regular file"):
            sd.load(path)


def read_damaged_files(whole, target):
    """Write and read damaged files with valid checksums."""
    content, dice, refused = whole.read_bytes(), random.Random(1), []
    for _ in range(60):
        damaged = bytearray(content)
        for _ in range(dice.choice([1, 5, 50])):
            damaged[dice.randrange(len(damaged))] = dice.randrange(256)
        target.write_bytes(damaged + checksum_line(damaged))
        try:
            sd.load(target)
        except sd.InputError as error:
            refused.append(str(error))
    assert all(map(str.isprintable, refused))
    assert len(refused) > 20


def test_damaged_files_with_valid_checksums(run, tmp_path):
    """Contract: HDF5 reads or refuses 60 damaged files with valid checksums without printing or crashing."""
    whole = sd.save(run.isel(time=slice(0, 3)), tmp_path / "whole.nc")
    with Duplicate(read_damaged_files, whole, tmp_path / "damaged.nc") as other:
        assert other.communicate() == ("", "")
    assert other.returncode == 0


def test_interrupt_inside_the_library(run, tmp_path, monkeypatch):
    """Contract: a file is read again after an error, as an interrupt leaves the library once as any exception."""
    target = sd.save(run, tmp_path / "run.nc")
    causes = iter([RuntimeError("interrupted")])

    class Interrupted(NetcdfFile):
        def __init__(self, path):
            for cause in causes:
                raise cause
            super().__init__(path)

    monkeypatch.setattr("scissordyn.file.netcdf.NetcdfFile", Interrupted)
    check_target(target)
    assert next(causes, None) is None


# HDF5 attributes with positions in the file, which differ between files with equal content
BESIDE = {"REFERENCE_LIST", "DIMENSION_LIST"}


@pytest.mark.parametrize(("name", "reads"), [("case.toml", "sd.read_case"), ("study.db", "sd.open_study")])
def test_case_or_study_instead_of_a_run(tmp_path, name, reads):
    """Contract: the error about a case file or a study names the function that reads it."""
    path = tmp_path / name
    path.write_text("", encoding="utf-8")
    with pytest.raises(sd.InputError, match=rf"as a run: .*for example {reads}\('.*{name}'\)"):
        sd.load(path)


def stored(path):
    """Return types, shapes, fill values and attributes of a file, by name."""
    with h5py.File(path) as file:
        parts = [
            (
                name,
                part.dtype,
                part.shape,
                str(part.fillvalue),
                {key: str(part.attrs[key]) for key in part.attrs.keys() - BESIDE},
            )
            for name, part in sorted(file.items())
        ]
        return [{key: str(value) for key, value in file.attrs.items()}, *parts]


def case(name):
    """Return a short run of an example."""
    made = sd.read_case(EXAMPLES / f"{name}.toml", ["run.until=3 ms", "run.samples=7"])
    return compute_results(made.mechanism, made.run)


def no_case():
    """Return rare kinds of data: a NUL and half a surrogate, single precision, an empty dimension."""
    return Results(
        {
            "name": Variable(("name",), np.array(["a\0b", "\ud800"]), {}),
            "share": Variable(("name",), np.array([0.5, np.nan], np.float32), {"units": "1"}),
            "count": Variable(("none",), np.zeros(0, np.int64), {"long_name": "é"}),
            "open": Variable(("name", "none"), np.zeros((2, 0), bool), {}),
        },
        {"title": "scissordyn \0", "end": 0.5, "count": 3, "attribute": "ü"},
    )


@pytest.mark.parametrize("name", ["paper", "four_bar", "self_deploying", ""])
def test_file_equals_that_of_xarray(tmp_path, name):
    """Second formulation: xarray writes the Dataset of the same results, and reads both."""
    results, files = case(name) if name else no_case(), [tmp_path / "direct.nc", tmp_path / "dataset.nc"]
    write_results(results, files[0])
    sd.save(as_dataset(results), files[1])
    xr.testing.assert_identical(*map(sd.load, files))
    direct, of_dataset = map(stored, files)
    assert direct == of_dataset
