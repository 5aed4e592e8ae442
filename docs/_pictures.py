"""Pictures, films and reports of the site, made when it is built: drawings, pictures of pages, gallery, examples, zoo, a study.

``python docs/_pictures.py`` draws what is missing or out of date, ``python docs/_pictures.py result`` draws one anew. The
picture of the README (``result``) and the screenshot of the explorer are in the repository: they are shown without a build.
"""

from __future__ import annotations

import hashlib
import io
import json
import sys
import time
import tomllib
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from functools import cache, partial
from multiprocessing import get_context
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parent
for folder in (ROOT / "tests", ROOT / "src", HERE):
    sys.path.insert(0, str(folder))

import _drawings  # noqa: E402

import scissordyn as sd  # noqa: E402
from scissordyn.casefile.case import CaseTable  # noqa: E402
from scissordyn.casefile.table import instance  # noqa: E402
from scissordyn.cli.main import status_of  # noqa: E402
from scissordyn.config.file import read_case  # noqa: E402
from scissordyn.file.provenance import provenance  # noqa: E402
from scissordyn.plot.animation import animate  # noqa: E402
from scissordyn.plot.file import write  # noqa: E402
from scissordyn.plot.over_time import comparison  # noqa: E402
from scissordyn.plot.report import draw_all  # noqa: E402
from scissordyn.plot.still import structure  # noqa: E402
from scissordyn.run.engine import processors  # noqa: E402
from scissordyn.run.simulate import simulate  # noqa: E402

__all__ = ["draw_pictures"]

STAMP = ROOT / "out" / "pictures.json"  # Digest of the inputs of each picture that was drawn
WINDOW = 1500, 860  # Width and height of the explorer [pixel]
PATIENCE = 600.0  # Longest time that the run of an example may take on a busy machine [s]
FILM, FILM_RATE = 4.0, 15  # Length of a film of the zoo [s], and its frames per second

STILLS = 0.0, 0.4, 0.8
"""Instants of stills as fractions of the run; a crank is not at the same place at two of them."""

ACROSS, TILE_DOTS = 3, 110  # Components in a row of their picture, and dots of each per inch
COLOURS = 128  # Of a screenshot: drawings need no more, and files are a quarter as large


def example(name: str) -> None:
    """Draw the stills of one example."""
    case = read_case(ROOT / "examples" / f"{name}.toml")
    run = simulate(case.mechanism, **case.run.keywords | {"samples": "auto"})
    position = run["position"].values
    returns = abs(position[-1] - position[0]).max() < 0.05 * (position.max() - position.min())
    instants = [part * float(run["time"][-1]) for part in (STILLS if returns else (0.0, 0.5, 1.0))]
    write(structure(run, case.mechanism, times=instants), HERE / "examples" / f"{name}.png")


def zoo(name: str) -> None:
    """Draw a mechanism of the zoo, and film it as a page."""
    entry = sd.zoo[name]
    run = entry.simulate()
    instants = [part * float(run["time"][-1]) for part in STILLS]
    write(structure(run, entry.mechanism, times=instants), HERE / "zoo" / f"{name}.png")
    films = HERE / "_static" / "zoo"
    films.mkdir(parents=True, exist_ok=True)
    animate(run, entry.mechanism, films / f"{name}.html", seconds=FILM, rate=FILM_RATE)


def study_report(name: str) -> None:
    """Compute a study of the examples, and write its report as a page."""
    store = STAMP.parent / "studies" / f"{name}.db"
    store.parent.mkdir(parents=True, exist_ok=True)
    for part in store.parent.glob(f"{name}.db*"):
        part.unlink()
    for words in (
        ["study", str(ROOT / "examples" / "studies" / f"{name}.toml"), "-o", str(store)],
        ["study", "report", str(store), "-o", str(HERE / "_static" / "studies" / f"{name}.html")],
    ):
        assert status_of(words) == 0, words


def components() -> None:
    """Draw each component in the example of its section of the page, under the name of its table."""
    from PIL import Image

    from components.page import PAGE, SECTIONS, heading, parts, snippets

    base, tiles = snippets(PAGE.read_text(encoding="utf-8"))[0], []
    for section in SECTIONS:
        text = f"{base}\n{snippets(parts()[heading(section)])[0]}".replace('"example"', f'"{section}"')
        mechanism = instance(CaseTable, tomllib.loads(text), {}).case().mechanism
        run = simulate(mechanism, until=0.1, samples=11)
        axes = structure(run, mechanism, times=[0.03])[0]
        axes.set_title("", loc="left")
        figure = axes.get_figure(root=True)
        assert figure is not None
        figure.set_size_inches(3.3, 1.9)
        drawn = io.BytesIO()
        figure.savefig(drawn, dpi=TILE_DOTS)
        tiles.append(Image.open(drawn).convert("RGB"))
    width, height = tiles[0].size
    whole = Image.new("RGB", (ACROSS * width, -(-len(tiles) // ACROSS) * height), "white")
    for k, tile in enumerate(tiles):
        whole.paste(tile, (k % ACROSS * width, k // ACROSS * height))
    whole.quantize(COLOURS).save(HERE / "components.png", optimize=True)


def gallery() -> None:
    """Draw every picture of the paper's case."""
    case = read_case(ROOT / "examples" / "paper.toml")
    options = case.run.keywords | {"samples": "auto"}
    run = simulate(case.mechanism, **options)
    ideal = simulate(case.mechanism.ideal(), **options)
    smaller = simulate(case.mechanism.replace("A.clearance", 0.2e-3), **options)
    draw_all(run, ideal, HERE / "gallery", case.mechanism)
    write(comparison(run, smaller, labels=("0.5 mm", "0.2 mm")), HERE / "gallery" / "comparison.png")


def preview() -> None:
    """Draw the array of the paper with its names."""
    write(sd.preview(read_case(ROOT / "examples" / "paper.toml").mechanism), HERE / "preview.png")


def driven_bar() -> None:
    """Draw an array of two units with each value of ``driven_bar``."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.4, 3.4), layout="constrained")
    for axes, driven in zip(figure.subplots(1, 2), ("pinned", "slider"), strict=True):
        sd.preview(sd.scissor(units=2, driven_bar=driven).driven(speed=1.0), axes=axes)
        axes.set_title(f'driven_bar = "{driven}"', loc="left", fontsize=10)
    write(figure, HERE / "driven_bar.png")


def statics() -> None:
    """Draw the static forces of the lift."""
    case = read_case(ROOT / "examples" / "lift.toml")
    write(sd.plot.statics(sd.statics(case.mechanism, until=case.run.until)), HERE / "statics.png")


def bending() -> None:
    """Draw the array of tubes of the page on bars that bend."""
    arm = sd.scissor(bar_length=2.0, bar_mass=5.68)
    moved = sd.with_bending(arm, section="tube 60x60x1.56 mm", material="steel").driven(speed=1.0)
    run = sd.simulate(moved, until=2e-3, samples=5, start="static")
    write(sd.plot.bending(run, moved), HERE / "bending.png")


def folding() -> None:
    """Draw the array of the page on mechanisms whose bars touch when it is folded."""
    ends = {"length": 1.0, "half_width": 0.025, "radius": 0.025, "stiffness": sd.law("stiffness", "power")(1e7)}
    pairs = [(f"unit {unit}/bar {layer}", f"unit {unit + 1}/bar {layer}") for unit in (1, 2) for layer in (1, 2)]
    touches = (sd.EdgeContact(f"touch {k}", (a, "start"), (b, "start"), **ends) for k, (a, b) in enumerate(pairs, start=1))
    arm = sd.scissor(units=3, angle=sd.degrees(60), bar_length=1.0, bar_mass=1.0, slider_mass=1.0, gravity=0.0)
    moved = arm.with_parts({"components": (sd.Torque("fold", "unit 1/bar 1", torque=5.0), *touches)})
    run = simulate(moved, until=1.74, samples=175)
    write(structure(run, moved, times=[0.0, 1.2, 1.73]), HERE / "folding.png")


def lubrication() -> None:
    """Draw the film of the page on oil."""
    oil = sd.Lubrication("ISO VG 46", temperature=313.15)
    joint = sd.Clearance(1e-4, friction=sd.LuGre(0.05), lubrication=oil)
    arm = sd.scissor(units=2).driven(speed=sd.rpm(150)).with_clearance("A", joint)
    write(sd.plot.film(sd.simulate(arm, until=0.06)), HERE / "lubrication.png")


def result() -> None:
    """Draw the picture of the README."""
    _drawings.result(HERE / "result.png")


def explorer() -> None:
    """Photograph the explorer after two thirds of a run, with influences, for which a browser is needed."""
    from PIL import Image

    from explore.browser import Tab, chromium, served

    with chromium() as browser, served(ROOT / "examples" / "paper.toml") as url:
        tab = Tab(browser, url, size=WINDOW, patience=PATIENCE)
        scrub = tab.page.locator("[data-id=scrub]")
        frame = 2 * int(scrub.get_attribute("max")) // 3
        scrub.fill(str(frame))
        tab.page.locator(f"canvas[data-frame='{frame}']").wait_for()
        tab.fine()
        tab.page.get_by_label("influence on").check()
        tab.page.locator("[data-key='drive.speed'] .sd-effect:visible").click(timeout=1e3 * PATIENCE)
        tab.page.get_by_role("button", name="Sort").click()
        tab.page.locator("[data-style=band]").wait_for()
        seen = tab.page.screenshot()
        tab.close()
    Image.open(io.BytesIO(seen)).convert("RGB").quantize(COLOURS).save(HERE / "explorer.png", optimize=True)


STUDIES = ("lift_table",)
"""Studies whose reports are on the site; the others take more than 10 minutes of processor time."""

EXAMPLES = tuple(path.stem for path in sorted((ROOT / "examples").glob("*.toml")))

GALLERY = "response", "force", "torque", "orbit", "energy", "structure", "comparison"

KEPT: dict[str, Callable[[], None]] = {"result": result, "explorer": explorer}
"""Pictures that are in the repository; they are drawn only if they are named."""


@cache
def drawn() -> dict[str, tuple[Callable[[], None], tuple[Path, ...], Path | None]]:
    """Return by name: what draws, the files that are drawn, and the case file if there is one; the longest first."""
    plain: dict[str, tuple[Callable[[], None], tuple[str, ...]]] = {
        "gallery": (gallery, tuple(f"gallery/{name}.png" for name in GALLERY)),
        "components": (components, ("components.png",)),
        "scissor_array": (partial(_drawings.scissor_array, HERE / "scissor_array.png"), ("scissor_array.png",)),
        "clearance_joint": (partial(_drawings.clearance_joint, HERE / "clearance_joint.png"), ("clearance_joint.png",)),
        **{
            one.__name__: (one, (f"{one.__name__}.png",))
            for one in (preview, driven_bar, statics, bending, folding, lubrication)
        },
    }
    found: dict[str, tuple[Callable[[], None], tuple[Path, ...], Path | None]] = {}
    for name in sorted(EXAMPLES, key=lambda name: name != "mast_twenty"):
        found[f"examples/{name}"] = (
            partial(example, name),
            (HERE / "examples" / f"{name}.png",),
            ROOT / "examples" / f"{name}.toml",
        )
    for name in STUDIES:
        report = HERE / "_static" / "studies" / f"{name}.html"
        found[f"studies/{name}"] = (partial(study_report, name), (report,), ROOT / "examples" / "studies" / f"{name}.toml")
    for name in sd.zoo:
        files = (HERE / "zoo" / f"{name}.png", HERE / "_static" / "zoo" / f"{name}.html")
        found[f"zoo/{name}"] = (partial(zoo, name), files, sd.zoo[name].case_file)
    return found | {name: (draw, tuple(HERE / file for file in files), None) for name, (draw, files) in plain.items()}


def _inputs(case: Path | None) -> str:
    """Return a digest of all sources and of the case file of a picture."""
    sources = provenance(skip=("cli", "explore", "exchange"))
    plot = b"".join(path.read_bytes() for path in sorted((ROOT / "src" / "scissordyn" / "plot").rglob("*.*")) if path.is_file())
    own = b"".join(path.read_bytes() for path in (HERE / "_pictures.py", HERE / "_drawings.py"))
    digest = hashlib.sha256(sources.encode() + plot + own + (b"" if case is None else case.read_bytes()))
    return digest.hexdigest()


def _draw(name: str) -> float:
    """Draw by name; return the processor time [s]."""
    began = time.process_time()
    draw, files, _ = drawn()[name]
    for file in files:  # folders of drawn pictures are not in the repository
        file.parent.mkdir(parents=True, exist_ok=True)
    draw()
    return time.process_time() - began


def draw_pictures() -> None:
    """Draw everything that is missing or out of date, in as many processes as there are processors."""
    stamps: dict[str, str] = json.loads(STAMP.read_text(encoding="utf-8")) if STAMP.exists() else {}
    wanted = {name: _inputs(case) for name, (_, _, case) in drawn().items()}
    missing = [
        name
        for name, (_, files, _) in drawn().items()
        if stamps.get(name) != wanted[name] or not all(file.exists() for file in files)
    ]
    if not missing:
        return
    STAMP.parent.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(min(processors(), len(missing)), mp_context=get_context("spawn")) as pool:
        for name, seconds in zip(missing, pool.map(_draw, missing), strict=True):
            stamps[name] = wanted[name]
            STAMP.write_text(json.dumps(stamps, indent=1), encoding="utf-8")
            print(f"drawn: {name} ({seconds:.1f} s)", flush=True)


def main(names: list[str]) -> None:
    """Draw the pictures that are named, or all that are missing."""
    for name in names:
        if name in KEPT:
            KEPT[name]()
        else:
            _draw(name)
    if not names:
        draw_pictures()


if __name__ == "__main__":
    main(sys.argv[1:])
