"""Checksums of saved runs: changes are noticed, and other programs can read the file."""

import contextlib
import hashlib
import re
import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr

import scissordyn as sd
from scissordyn.explore.case import open_case
from scissordyn.file.checksum import CHUNK_BYTES, LINE_BYTES, verify_checksum
from scissordyn.file.netcdf import chunk_options


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Return a small file with numbers, truth values, texts and an empty variable."""
    values = {
        "position": (("time", "axis"), np.linspace(0.1, 0.9, 6).reshape(3, 2), {"units": "m"}),
        "in_contact": ("time", [True, False, True]),
        "peak": ("contact", np.zeros(0)),
        "axis": ("axis", ["x", "y"]),
    }
    run = xr.Dataset(values, attrs={"title": "scissordyn run", "end": 0.5})
    return sd.save(run, tmp_path_factory.mktemp("whole") / "run.nc")


def flipped(content, bit):
    """Return a content with one bit changed."""
    byte = content[bit // 8] ^ 1 << bit % 8
    return content[: bit // 8] + bytes([byte]) + content[bit // 8 + 1 :]


def test_flipped_bits_are_noticed(whole, tmp_path):
    """Contract: the file is refused, or has no checksum if the bit is in the marker of the checksum line."""
    content, target, unmarked = whole.read_bytes(), tmp_path / "run.nc", set[int]()
    for byte in range(len(content)):
        target.write_bytes(flipped(content, 8 * byte + byte % 8))
        with contextlib.suppress(ValueError):
            assert not verify_checksum(target)
            unmarked.add(byte)
    assert verify_checksum(whole)
    assert unmarked == set(range(len(content) - LINE_BYTES, len(content) - 65))


def test_damaged_run_is_refused(whole, tmp_path):
    """Contract: `load` and the explorer refuse a damaged file in one line."""
    content, damaged = whole.read_bytes(), tmp_path / "damaged.nc"
    damaged.write_bytes(flipped(content, 8 * content.index(np.float64(0.1).tobytes())))
    for read in (sd.load, open_case):
        with pytest.raises(sd.InputError, match=r"cannot read .* as a run: its content does not match its checksum"):
            read(damaged)


def test_run_without_checksum(whole, tmp_path):
    """Contract: files of other programs are read with a warning; saved again they have a checksum."""
    other = tmp_path / "other.nc"
    sd.load(whole).to_netcdf(other, engine="h5netcdf")
    with pytest.warns(UserWarning, match=re.escape(f"'{other}' has no checksum: damage cannot be detected")):
        run = sd.load(other)
    sd.save(run, other)
    xr.testing.assert_identical(sd.load(other), sd.load(whole))


def by_hdf5(path):
    """Return an attribute and a variable, read by HDF5."""
    with h5py.File(path) as file:
        return float(file.attrs["end"][0]), np.asarray(file["position"])


def test_other_programs_read_the_file(whole, tmp_path):
    """Contract: xarray and HDF5 read it; HDF5's own checksums refuse a flipped bit in a variable or attribute."""
    with xr.open_dataset(whole, engine="h5netcdf") as other:
        xr.testing.assert_identical(other.load(), sd.load(whole))
    content, damaged = whole.read_bytes(), tmp_path / "damaged.nc"
    for number in (np.float64(0.9), np.float64(0.5)):  # of a variable, of an attribute
        damaged.write_bytes(flipped(content, 8 * content.index(number.tobytes()) + 60))
        with pytest.raises((OSError, KeyError)):
            by_hdf5(damaged)


def test_file_changed_by_another_program(whole, tmp_path):
    """Contract: HDF5 removes the checksum line when it changes a file, so that the change is not taken for damage."""
    changed = Path(shutil.copy(whole, tmp_path / "changed.nc"))
    with h5py.File(changed, "r+") as file:
        file.attrs["note"] = "mine"
    assert not verify_checksum(changed)


def test_checksum_of_common_tools(whole):
    """Cross-check: `head -c -N run.nc | sha256sum` gives the digits of the last line."""
    content = whole.read_bytes()
    assert content[-65:-1].decode() == hashlib.sha256(content[:-LINE_BYTES]).hexdigest()


@pytest.mark.parametrize("rows", [1, CHUNK_BYTES // 16, CHUNK_BYTES // 16 + 1, 10 * CHUNK_BYTES // 16 + 7])
def test_chunks_are_small_and_full(rows):
    """Limit: no chunk exceeds HDF5's cache, and unused rows are fewer than chunks."""
    first, *rest = chunk_options(np.broadcast_to(0.0, (rows, 2)))["chunks"]
    count = -(-rows // first)
    assert rest == [2]
    assert 16 * first <= CHUNK_BYTES
    assert count * first - rows < count
