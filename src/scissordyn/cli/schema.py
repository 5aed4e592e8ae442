"""``scissordyn schema``: the JSON Schema of a kind of file, for editors."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from scissordyn.errors import InputError, command


def schema(
    which: Annotated[str, typer.Argument(help="case or study.")] = "case",
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Write it to this file, which ends in .json.")] = None,
) -> int:
    """Print the JSON Schema of case or study files; '#:schema case.json' on top of a file makes an editor use it."""
    from scissordyn.config.schema import schema as made
    from scissordyn.file.output_file import check_target, write_file

    if output is not None:
        if output.suffix.lower() != ".json":
            raise InputError(f"schema in '{output}'", "a name that ends in .json", command("-o", f"{which}.json"))
        check_target(output, sample=command("-o", f"{which}.json"))
    text = json.dumps(made(which), indent=1, ensure_ascii=False)
    if output is None:
        print(text)
    else:
        print(write_file(output, f"{text}\n".encode(), sample=command("-o", f"{which}.json")))
    return 0
