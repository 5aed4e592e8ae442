"""``scissordyn examples``: the case files and studies that come with the package."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from scissordyn.cli.output import check_folder
from scissordyn.config.examples import folder_of_examples
from scissordyn.errors import InputError, did_you_mean


def examples(
    name: Annotated[str, typer.Argument(help="Print this one.", show_default=False)] = "",
    copy: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="DIR", help="Copy it, or all of them, into this folder.")
    ] = None,
) -> int:
    """List the examples, print one, or copy them."""
    from scissordyn.cli.show import console
    from scissordyn.file.output_file import write_file

    folder = folder_of_examples()
    known = {path.relative_to(folder).with_suffix("").as_posix(): path for path in sorted(folder.rglob("*.toml"))}
    if not known:
        raise InputError(f"no examples in '{folder}'", "an installation with its examples")
    if name and name not in known:
        raise InputError(f"no example '{name}'{did_you_mean(name, known)}", ", ".join(known), "scissordyn examples paper")
    to = console()
    if copy is not None:
        check_folder(copy, "-o examples")
        chosen = [known[name]] if name else [path for path in sorted(folder.rglob("*")) if path.suffix in (".toml", ".py")]
        for path in chosen:
            target = copy / path.relative_to(folder)
            content = path.read_bytes()
            if not target.exists():
                target.parent.mkdir(parents=True, exist_ok=True)
                write_file(target, content, sample="-o examples")
            elif target.read_bytes() != content:
                raise InputError(f"'{target}' exists and is another file", "a folder without it", "-o examples")
            to.print(str(target), markup=False)
        return 0
    if name:
        print(known[name].read_text(encoding="utf-8"), end="")
        return 0
    for one, path in known.items():
        to.print(f"{one:32}  {_first_sentence(path)}", markup=False)
    to.print("Print one: scissordyn examples paper > case.toml; copy all: scissordyn examples -o examples", markup=False)
    return 0


def _first_sentence(path: Path) -> str:
    """What the comment at the top says, up to the end of its first sentence or part of one."""
    lines = []
    for line in path.read_text(encoding="utf-8").splitlines():
        if not line.startswith("#"):
            break
        lines.append(line.lstrip("# "))
    return " ".join(lines).partition(": ")[0].partition(". ")[0].partition("; ")[0].rstrip(".")
