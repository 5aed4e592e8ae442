"""Pictures of the documentation: stills of the examples, gallery, zoo, explorer, and the film of the front page.

``python -m benchmarks.pictures`` draws all of them, ``python -m benchmarks.pictures lift gallery`` some.
"""

from __future__ import annotations

import io
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import scissordyn as sd
from benchmarks.drawings import clearance_joint, result
from scissordyn.casefile.case import CaseTable
from scissordyn.casefile.table import instance
from scissordyn.config.file import read_case
from scissordyn.plot.animation import animate
from scissordyn.plot.file import write
from scissordyn.plot.over_time import comparison
from scissordyn.plot.report import draw_all
from scissordyn.plot.still import structure
from scissordyn.run.simulate import simulate

ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs"
WINDOW = 1500, 860  # Width and height of the explorer [pixel]
PATIENCE = 600.0  # Longest time that the run of an example may take on a busy machine [s]
FILM, FILM_RATE, FILM_WIDTH = 4.0, 15, 720  # Length of a film of the zoo [s], its frames per second, and its width [pixel]

STILLS = 0.0, 0.4, 0.8
"""Instants of the stills of the zoo, as fractions of the run; a crank is not at the same place at two of them."""

ACROSS, TILE_DOTS = 4, 110  # Components in a row of their picture, and dots of each per inch
COLOURS = 128  # Of a screenshot: drawings need no more, and files are a quarter as large


def draw(name: str) -> None:
    """Draw the stills of one example."""
    case = read_case(ROOT / "examples" / f"{name}.toml")
    run = simulate(case.mechanism, **case.run.keywords | {"samples": "auto"})
    figure = structure(run, case.mechanism)[0].get_figure(root=True)
    assert figure is not None
    print(write(figure, DOCS / "examples" / f"{name}.png"), flush=True)


def screenshot(case: Path, browser: Any, target: Path) -> Path:
    """The explorer after two thirds of the run of a case."""
    from PIL import Image

    from explore.browser import Tab, served

    with served(case) as url:
        tab = Tab(browser, url, size=WINDOW, patience=PATIENCE)
        scrub = tab.page.locator("[data-id=scrub]")
        frame = 2 * int(scrub.get_attribute("max")) // 3
        scrub.fill(str(frame))
        tab.page.locator(f"canvas[data-frame='{frame}']").wait_for()
        seen = tab.page.screenshot()
        tab.close()
    Image.open(io.BytesIO(seen)).convert("RGB").quantize(COLOURS).save(target, optimize=True)
    return target


def smaller(film: Path) -> Path:
    """The film as wide as a page of the site, in colours that differ little."""
    made = film.with_suffix(".small.mp4")
    how = ["-vf", f"scale={FILM_WIDTH}:-2", "-c:v", "libx264", "-preset", "slow", "-crf", "32", "-pix_fmt", "yuv420p"]
    subprocess.run(["ffmpeg", "-loglevel", "error", "-y", "-i", film, *how, "-movflags", "+faststart", made], check=True)
    return made.replace(film)


def zoo(name: str) -> None:
    """Draw a mechanism of the zoo, and film it."""
    entry = sd.zoo[name]
    run = entry.simulate()
    instants = [part * float(run["time"][-1]) for part in STILLS]
    figure = structure(run, entry.mechanism, times=instants)[0].get_figure(root=True)
    assert figure is not None
    target = DOCS / "_static" / "zoo" / f"{name}.mp4"
    print(write(figure, DOCS / "zoo" / f"{name}.png"), flush=True)
    film = smaller(animate(run, entry.mechanism, target, seconds=FILM, rate=FILM_RATE))
    print(film, f"{film.stat().st_size / 1e3:.0f} kB", flush=True)


def components() -> Path:
    """Draw each component in the example of its section of the page, under the name of its table."""
    from PIL import Image

    from components.page import PAGE, SECTIONS, heading, parts, snippets

    base, tiles = snippets(PAGE.read_text(encoding="utf-8"))[0], []
    for section in SECTIONS:
        text = f"{base}\n{snippets(parts()[heading(section)])[0]}".replace('"example"', f'"{section}"')
        mechanism = instance(CaseTable, tomllib.loads(text), {}).case().mechanism
        run = simulate(mechanism, until=0.1, samples=11)
        axes = structure(run, mechanism, times=[0.03])[0]
        axes.set(xlabel="", ylabel="", xticklabels=[], yticklabels=[])
        axes.set_title("", loc="left")
        figure = axes.get_figure(root=True)
        assert figure is not None
        figure.set_size_inches(3.3, 1.8)
        drawn = io.BytesIO()
        figure.savefig(drawn, dpi=TILE_DOTS)
        tiles.append(Image.open(drawn).convert("RGB"))
    width, height = tiles[0].size
    whole = Image.new("RGB", (ACROSS * width, -(-len(tiles) // ACROSS) * height), "white")
    for k, tile in enumerate(tiles):
        whole.paste(tile, (k % ACROSS * width, k // ACROSS * height))
    whole.quantize(COLOURS).save(DOCS / "components.png", optimize=True)
    return DOCS / "components.png"


def gallery() -> None:
    """Draw every picture of the paper's case."""
    case = read_case(ROOT / "examples" / "paper.toml")
    options = case.run.keywords | {"samples": "auto"}
    run = simulate(case.mechanism, **options)
    ideal = simulate(case.mechanism.ideal(), **options)
    smaller = simulate(case.mechanism.replace("A.clearance", 0.2e-3), **options)
    drawn = draw_all(run, ideal, DOCS / "gallery", case.mechanism)
    figure = comparison(run, smaller, labels=("0.5 mm", "0.2 mm"))[0].get_figure(root=True)
    assert figure is not None
    print(*drawn, write(figure, DOCS / "gallery" / "comparison.png"), sep="\n", flush=True)


def front() -> None:
    """Film the deployment on the front page."""
    case = read_case(ROOT / "examples" / "solar_array.toml")
    print(
        animate(simulate(case.mechanism, **case.run.keywords), case.mechanism, DOCS / "_static" / "deployment.mp4"), flush=True
    )


def main(wanted: list[str]) -> None:
    """Draw the pictures that are named, or all."""
    sys.path.insert(0, str(ROOT / "tests"))
    from explore.browser import chromium, missing

    names = [path.stem for path in sorted((ROOT / "examples").glob("*.toml")) if not wanted or path.stem in wanted]
    if not wanted or "gallery" in wanted:
        gallery()
    if not wanted or "components" in wanted:
        print(components(), flush=True)
    if not wanted or "front" in wanted:
        front()
    if not wanted or "joint" in wanted:
        print(clearance_joint(DOCS / "clearance_joint.png"), flush=True)
    if not wanted or "result" in wanted:
        print(result(DOCS / "result.png"), flush=True)
    for name in sd.zoo:
        if not wanted or name in wanted or "zoo" in wanted:
            zoo(name)
    for name in names:
        draw(name)
    if not wanted or "explorer" in wanted:
        if missing():
            print(f"without the explorer: {missing()}")
            return
        with chromium() as browser:
            print(screenshot(ROOT / "examples" / "paper.toml", browser, DOCS / "explorer.png"))


if __name__ == "__main__":
    main(sys.argv[1:])
