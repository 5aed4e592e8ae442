"""``scissordyn wear``: answers, pictures, interruption and continuation, and what is refused."""

import json
import shutil
from unittest.mock import Mock

import numpy as np
import pytest
import xarray as xr
from PIL import Image

import scissordyn as sd
from scissordyn.cli.main import status_of
from scissordyn.plot.wear import film, history, profile

# Case file with a joint that wears
CASE = """
[structure]
kind = "slider-crank"

[drive]
speed = "3000 rpm"

[[clearance]]
joint = "slider pin"
clearance = "0.1 mm"
restitution = 0.7
wear = "1e-4 mm^3/(N m)"

[wear]
cycles = 1500
members = 2
settle = 0
angles = 180
most_clearance = "0.103 mm"

[run]
until = "40 ms"
rtol = 1e-6
atol = 1e-6
"""


@pytest.fixture
def case(folder):
    """Return the name of a case file whose joint wears fast."""
    (folder / "case.toml").write_text(CASE, encoding="utf-8")
    return "case.toml"


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Return the file of a complete result of the case."""
    place = tmp_path_factory.mktemp("whole")
    (place / "case.toml").write_text(CASE, encoding="utf-8")
    assert status_of(["wear", str(place / "case.toml"), "-o", str(place / "life.nc"), "-q"]) == 0
    return place / "life.nc"


def test_answers_and_pictures(case, whole, folder, capfd):
    """Contract: the answers and the pictures of a complete file; the same in SI units as JSON."""
    shutil.copy(whole, "life.nc")
    assert status_of(["wear", case, "-o", "life.nc", "--plot", "pictures"]) == 0
    lines = capfd.readouterr().out.splitlines()
    assert lines[0].startswith("clearance of joint 'slider pin' at most 103 µm: fails after ")
    assert "limited by joint 'slider pin'" in lines[0]
    assert lines[1].startswith("joint 'slider pin' after 1500 cycles: ")
    assert {path.name for path in (folder / "pictures").iterdir()} == {"wear.png", "profile-1.png"}
    assert status_of(["wear", case, "-o", "life.nc", "--json"]) == 0
    said, kept = json.loads(capfd.readouterr().out), sd.load("life.nc")
    assert said["lives"][0]["life"] == float(kept["life"][0])
    assert said["joints"]["slider pin"]["worn_volume"] == float(kept["worn_volume"][-1, 0])
    low, life, high = (said["lives"][0][name] for name in ("life_low", "life", "life_high"))
    assert 0.0 < low <= life <= high < 1500
    with Image.open(film(kept, folder / "life.gif", seconds=0.2, rate=10)) as frames:
        assert frames.n_frames == 2
        first = np.asarray(frames.convert("RGB"), int)
        frames.seek(1)
        moved = np.abs(np.asarray(frames.convert("RGB"), int) - first).sum(axis=2) > 0
    for half in np.split(moved[:, : 2 * (moved.shape[1] // 2)], 2, axis=1):  # the profile and the cycle
        assert half.any()


def test_preview_estimates_the_life(case, folder, capfd):
    """Contract: the answers of `wear` with ideal loads, and one sentence on how far to trust them; none without wear."""
    assert status_of(["preview", case]) == 0
    lines = " ".join(capfd.readouterr().out.split())
    assert status_of(["wear", case, "--set", "wear.loads=ideal"]) == 0
    answers = capfd.readouterr().out.splitlines()
    assert answers[0].startswith("clearance of joint 'slider pin' at most 103 µm: fails after ")
    assert all(f"Wear: {line}." in lines for line in answers[:2])
    assert "Wear: estimated from forces of ideal joints: close while journals stay in contact" in lines
    (folder / "round.toml").write_text(CASE.replace('wear = "1e-4 mm^3/(N m)"\n', ""), encoding="utf-8")
    assert status_of(["preview", "round.toml"]) == 0
    assert "Wear" not in capfd.readouterr().out


def test_report_and_film(case, folder, monkeypatch):
    """Contract: one file with the answers first, the table of joints, and pictures of contours; a film, .mp4 with ffmpeg."""
    monkeypatch.setattr("scissordyn.plot.wear.FRAME_RATES", dict.fromkeys(("mp4", "gif"), 1))
    movie, magic = ("film.mp4", b"ftyp") if shutil.which("ffmpeg") else ("film.gif", b"GIF8")
    assert status_of(["wear", case, "--set", "wear.loads=ideal", "--report", "life.html", "--animate", movie, "-q"]) == 0
    assert magic in (folder / movie).read_bytes()[:12]
    text = (folder / "life.html").read_text(encoding="utf-8")
    first = text.index("<strong>clearance of joint &#39;slider pin&#39; at most 103 µm: fails after ")
    assert first < text.index("<h2>Joints</h2>") < text.index("<h2>Worn bearing of joint slider pin</h2>")
    assert text.count("data:image/png;base64,") == 2


def test_an_interrupted_command_goes_on(case, whole, capfd, monkeypatch):
    """Contract: Ctrl-C leaves the simulated states in the file; the same command goes on to the result of one run."""
    from scissordyn.lifetime import wear

    simulate, count = wear.CycleRunner.loads, 0

    def interrupted(*arguments):
        nonlocal count
        count += 1
        if count == 3:
            raise KeyboardInterrupt
        return simulate(*arguments)

    capfd.readouterr()
    with monkeypatch.context() as patched:
        patched.setattr(wear.CycleRunner, "loads", interrupted)
        assert status_of(["wear", case, "-o", "life.nc"]) == 130
    shown = capfd.readouterr()
    assert "Saved to life.nc, marked interrupted" in shown.out
    assert shown.err == "scissordyn: interrupted; scissordyn wear case.toml -o life.nc continues from there\n"
    assert sd.load("life.nc").sizes["state"] == 2
    assert status_of(["wear", case, "-o", "life.nc"]) == 0
    xr.testing.assert_identical(sd.load("life.nc"), sd.load(whole))


def test_interruption_before_the_first_cycle(case, folder, capfd, monkeypatch):
    """Contract: Ctrl-C before anything is simulated is one line, writes no file, and JSON is not mixed with text."""
    monkeypatch.setattr("scissordyn.lifetime.wear.CycleRunner.loads", Mock(side_effect=KeyboardInterrupt))
    assert status_of(["wear", case, "-o", "life.nc", "--json"]) == 130
    shown = capfd.readouterr()
    assert (shown.out, shown.err) == ("", "scissordyn: interrupted\n")
    assert not (folder / "life.nc").exists()


def test_what_is_refused(case, folder, refused):
    """Contract: one line each: no coefficient, a result of another case, another kind of file."""
    (folder / "other.toml").write_text(CASE.replace('wear = "1e-4 mm^3/(N m)"\n', ""), encoding="utf-8")
    assert "no clearance joint has a coefficient of wear" in refused("wear", "other.toml")
    assert status_of(["wear", case, "--cycles", "10", "-o", "life.nc", "-q"]) == 0
    assert "has another case or other options" in refused("wear", case, "--set", "drive.speed=2900 rpm", "-o", "life.nc")
    assert "expected a" in refused("wear", case, "--set", "clearance.wear='1e-4 mm^3/N'")
    pairs = CASE.replace('wear = "1e-4 mm^3/(N m)"\n', "") + '\n[wear.coefficients]\n"steel/bronze" = "1e-4 mm^3/(N m)"\n'
    (folder / "pairs.toml").write_text(pairs, encoding="utf-8")
    assert "joint 'slider pin': no wear coefficient for 'steel/steel'" in refused("wear", "pairs.toml")
    (folder / "oil.toml").write_text(CASE.replace("[wear]", 'slip = "contact-points"\n\n[wear]'), encoding="utf-8")
    assert "did you mean 'gif'" in refused("wear", case, "--animate", "life.gfi")
    assert "wear of a joint with lubrication" in refused("wear", "oil.toml")


def test_pictures_of_other_datasets():
    run = xr.Dataset(attrs={"title": "scissordyn run"})
    for picture in (profile, history):
        with pytest.raises(sd.InputError, match="cannot draw wear from a 'scissordyn run'"):
            picture(run)
