"""Checksums of saved runs: what is changed is noticed, and other programs read the file."""

from __future__ import annotations

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
from scissordyn.file.checksum import LINE_BYTES, verify_checksum
from scissordyn.file.netcdf import CHUNK_BYTES, chunk_options


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small file with numbers, truth values, texts and an empty variable."""
    values = {
        "position": (("time", "axis"), np.linspace(0.1, 0.9, 6).reshape(3, 2), {"units": "m"}),
        "in_contact": ("time", [True, False, True]),
        "peak": ("contact", np.zeros(0)),
        "axis": ("axis", ["x", "y"]),
    }
    run = xr.Dataset(values, attrs={"title": "scissordyn run", "end": 0.5})
    return sd.save(run, tmp_path_factory.mktemp("whole") / "run.nc")


def flipped(content: bytes, bit: int) -> bytes:
    """A content in which one bit is changed."""
    byte = content[bit // 8] ^ 1 << bit % 8
    return content[: bit // 8] + bytes([byte]) + content[bit // 8 + 1 :]


def test_a_flipped_bit_of_any_byte_is_noticed(whole: Path, tmp_path: Path) -> None:
    """Contract: the file is refused, or without a checksum if the bit is in the name of that; benchmarks flip every bit."""
    content, target, unmarked = whole.read_bytes(), tmp_path / "run.nc", set[int]()
    for byte in range(len(content)):
        target.write_bytes(flipped(content, 8 * byte + byte % 8))
        with contextlib.suppress(ValueError):
            assert not verify_checksum(target)
            unmarked.add(byte)
    assert verify_checksum(whole)
    assert unmarked == set(range(len(content) - LINE_BYTES, len(content) - 65))


def test_a_run_that_is_damaged_is_not_read(whole: Path, tmp_path: Path) -> None:
    """Contract: `load` and the explorer refuse it in one line."""
    content, damaged = whole.read_bytes(), tmp_path / "damaged.nc"
    damaged.write_bytes(flipped(content, 8 * content.index(np.float64(0.1).tobytes())))
    for read in (sd.load, open_case):
        with pytest.raises(sd.InputError, match=r"cannot read .* as a run: its content does not match its checksum"):
            read(damaged)


def test_a_run_without_checksum_is_read_with_a_warning(whole: Path, tmp_path: Path) -> None:
    """Contract: the files of other programs are read; saved again they have a checksum."""
    other = tmp_path / "other.nc"
    sd.load(whole).to_netcdf(other, engine="h5netcdf")
    with pytest.warns(UserWarning, match=re.escape(f"'{other}' has no checksum: damage to it is not noticed")):
        run = sd.load(other)
    sd.save(run, other)
    xr.testing.assert_identical(sd.load(other), sd.load(whole))


def by_hdf5(path: Path) -> tuple[float, np.ndarray]:
    """An attribute and a variable."""
    with h5py.File(path) as file:
        return float(file.attrs["end"][0]), np.asarray(file["position"])


def test_other_programs_read_the_file_and_notice_changed_numbers(whole: Path, tmp_path: Path) -> None:
    """Contract: xarray and HDF5 read it; HDF5's own checksums refuse a flipped bit in a variable or in an attribute."""
    with xr.open_dataset(whole, engine="h5netcdf") as other:
        xr.testing.assert_identical(other.load(), sd.load(whole))
    content, damaged = whole.read_bytes(), tmp_path / "damaged.nc"
    for number in (np.float64(0.9), np.float64(0.5)):  # of a variable, of an attribute
        damaged.write_bytes(flipped(content, 8 * content.index(number.tobytes()) + 60))
        with pytest.raises((OSError, KeyError)):
            by_hdf5(damaged)


def test_what_other_programs_change_has_no_checksum(whole: Path, tmp_path: Path) -> None:
    """Limit: HDF5 drops the line when a file is opened to be changed; the change is no damage."""
    changed = Path(shutil.copy(whole, tmp_path / "changed.nc"))
    with h5py.File(changed, "r+") as file:
        file.attrs["note"] = "mine"
    assert not verify_checksum(changed)


def test_the_checksum_is_that_of_common_tools(whole: Path) -> None:
    """Cross-check: `head -c -N run.nc | sha256sum` gives the digits of the last line."""
    content = whole.read_bytes()
    assert content[-65:-1].decode() == hashlib.sha256(content[:-LINE_BYTES]).hexdigest()


@pytest.mark.parametrize("rows", [1, CHUNK_BYTES // 16, CHUNK_BYTES // 16 + 1, 10 * CHUNK_BYTES // 16 + 7])
def test_chunks_are_small_and_full(rows: int) -> None:
    """Limit: none is larger than HDF5's cache, and the last one has fewer unused rows than there are chunks."""
    first, *rest = chunk_options(np.broadcast_to(0.0, (rows, 2)))["chunks"]
    count = -(-rows // first)
    assert rest == [2]
    assert 16 * first <= CHUNK_BYTES
    assert count * first - rows < count
