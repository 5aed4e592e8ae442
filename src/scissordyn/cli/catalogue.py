"""Commands ``laws``, ``controllers``, ``zoo``, ``examples``, ``new`` and ``schema``: what the package contains."""

from __future__ import annotations

import dataclasses
import inspect
import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from scissordyn.cli.output import DONE, PLAIN_COLUMNS, UNFINISHED, check_folder, check_picture, console, print_table, say
from scissordyn.cli.parameter import Argument, Option
from scissordyn.errors import InputError, command, did_you_mean
from scissordyn.file.output_file import check_target, write_file
from scissordyn.units import short

if TYPE_CHECKING:
    from scissordyn.collection.catalogue import Entry


# style of each column in the printed catalogue, by heading
CATALOGUE_COLUMNS = {"name": "name", "description": "text", "source": "text"}

# LaTeX names of Greek letters, each followed by its letter
GREEK_LETTERS = (
    "alpha α beta β gamma γ delta δ epsilon ε varepsilon ε zeta ζ eta η theta θ iota ι kappa κ lambda λ mu μ nu ν xi ξ pi π "
    "rho ρ sigma σ tau τ phi φ varphi φ chi χ psi ψ omega ω Gamma Γ Delta Δ Theta Θ Lambda Λ Sigma Σ Phi Φ Psi Ψ Omega Ω"
)
GREEK_SIGNS = dict(zip(GREEK_LETTERS.split()[::2], GREEK_LETTERS.split()[1::2], strict=True))  # Greek letter by its LaTeX name

# LaTeX commands, each with "=" and the sign that replaces it in plain text
LATEX_COMMANDS = (
    "cdot=· times=× le=≤ leq=≤ ge=≥ geq=≥ ne=≠ approx=≈ infty=∞ pm=± to=→ int=∫ sum=Σ partial=∂ ldots=... dots=... quad=\n "
    "qquad=\n left= right= bigl= bigr= big= Big= displaystyle= prime=' langle=< rangle=> lVert=| rVert=| |=|"
)
COMMAND_SIGNS = dict(pair.split("=") for pair in LATEX_COMMANDS.split(" "))
"""Sign that replaces each LaTeX command in plain text; any other command, such as \\sin, is replaced by its name."""

GROUP = r"\{((?:[^{}]|\{[^{}]*\})*)\}"  # pattern of a LaTeX group in braces
FUNCTIONS = "ln|log|exp|sin|cos|tan|tanh|cosh|sinh"  # Names of LaTeX functions that may precede a fraction
TOKEN = re.compile(r"(?:\\[A-Za-z]+|[A-Za-z])(?:_\w|_\{\w+\})?(?:'|\^\*|\^\d)?|\d+(?:\.\d+)?|\|[^|]+\|")
"""Pattern of a formula with a single factor, which needs no parentheses as a part of a fraction."""

# translation table from digits and minus to superscripts, for exponents in plain text
SUPERSCRIPTS = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")


def laws(
    name: Annotated[str | None, Argument(help="A law or material, or your class as FILE.py:CLASS.")] = None,
    plot: Annotated[Path | None, Option(help="Draw the law, or an impact with each law, into this file.")] = None,
) -> int:
    from scissordyn.laws.catalogue import BY_KIND, MATERIALS, kind_in

    if name is not None and ".py:" in name:
        kinds = [kind_in(name)]
    else:
        kinds = [kind for kind, those in BY_KIND.items() if name in those]
    if name is not None and not kinds and name not in MATERIALS:
        names = [*dict.fromkeys(law for those in BY_KIND.values() for law in those), *MATERIALS]
        raise InputError(f"unknown law or material '{name}'{did_you_mean(name, names)}", ", ".join(names), "scissordyn laws")
    if plot is not None and name is not None and not kinds:
        raise InputError(f"--plot with the material '{name}'", "a law", "scissordyn laws flores --plot law.png")
    check_picture(plot, Path(), "--plot law.png")
    if name is None:
        _list_laws()
    else:
        for kind in kinds:
            _describe(kind, name)
        if name in MATERIALS:
            material = MATERIALS[name]
            say(
                f"{name}, a material: E = {material.youngs_modulus / 1e9:g} GPa, nu = {material.poisson_ratio:g}, "
                f"rho = {material.density:g} kg/m^3. Source: {material.source}"
            )
    if plot is not None:
        from scissordyn.laws.catalogue import law
        from scissordyn.plot.file import write
        from scissordyn.plot.law import draw_gallery, draw_law

        write(draw_gallery() if name is None else draw_law(_with_defaults(law(kinds[0], name))), plot)
        print(f"Drawn into {plot}" + (f", as a law of {kinds[0]}" if len(kinds) > 1 else ""))
    return 0


def _row(name: str, element: Any) -> tuple[str, str, str]:
    """Return name, summary and source of an element, as a row of a table."""
    return name, (element.__doc__ or "").strip().splitlines()[0], element.source


def _with_defaults(law: Any) -> Any:
    """Return a law with the default values of its parameters; raise `InputError` if a parameter has no default."""
    needed = [field.name for field in dataclasses.fields(law) if field.default is field.default_factory]
    if needed:
        raise InputError(
            f"no picture of '{law.__name__}': its parameter {needed[0]} has no default",
            "a law with defaults, or a picture in Python",
            f"sd.plot.law({law.__name__}({', '.join(f'{name}=...' for name in needed)}))",
        )
    return law()


def _list_laws() -> None:
    from scissordyn.laws.catalogue import BY_KIND, MATERIALS
    from scissordyn.laws.oil import OILS

    for kind, names in BY_KIND.items():
        print_table(CATALOGUE_COLUMNS, [_row(name, law) for name, law in names.items()], kind)
    materials = {name: (1e-9 * part.youngs_modulus, part.poisson_ratio, part.density) for name, part in MATERIALS.items()}
    oils = {name: (1e6 * part.viscosity_40, 1e6 * part.viscosity_100, part.density) for name, part in OILS.items()}
    for title, parts, numbers, heads in (
        ("material", MATERIALS, materials, ("E [GPa]", "nu", "rho [kg/m^3]")),
        ("oil", OILS, oils, ("nu at 40 deg C [mm^2/s]", "at 100 deg C", "rho [kg/m^3]")),
    ):
        rows = [(name, *(f"{number:g}" for number in numbers[name]), part.source) for name, part in parts.items()]
        print_table({"name": "name", **dict.fromkeys(heads, "numbers"), "source": "text"}, rows, title)
    say("scissordyn laws NAME shows one with its parameters.")


def _describe(kind: str, name: str) -> None:
    from scissordyn.laws.catalogue import law

    element = law(kind, name)
    notes = [f"Source: {element.source}"]
    if getattr(element, "restitution_range", None) is not None:
        notes.append("Made for restitution coefficients from {:g} to {:g}.".format(*element.restitution_range))
    if getattr(element, "states", ()):
        notes.append(f"Internal states: {', '.join(state.name for state in element.states)}.")
    if getattr(element, "stiff", False):
        notes.append("Makes the equations of motion stiff.")
    if getattr(element, "caveat", ""):
        notes.append(f"Caveat: {element.caveat}")
    chosen = "".join(f", {sample}" for sample in print_element(element, f"{name}, a law of {kind}", notes)[:1])
    say("In a case file: " + (f'{kind} = {{ law = "{name}"{chosen} }}' if chosen else f'{kind} = "{name}"'))


def controllers(
    name: Annotated[str | None, Argument(help="A controller, or your class as FILE.py:CLASS.")] = None,
) -> int:
    from scissordyn.casefile.table import toml_entries
    from scissordyn.casefile.value import CONTROLLER_EXAMPLE
    from scissordyn.control.catalogue import CONTROLLERS, controller

    if name is None:
        print_table(CATALOGUE_COLUMNS, [_row(key, of) for key, of in CONTROLLERS.items()])
        say("scissordyn controllers NAME shows one with its parameters.")
        return 0
    element: type = controller(name)
    samples = print_element(element, f"{name}, a controller", [f"Source: {vars(element)['source']}"])
    examples = toml_entries(CONTROLLER_EXAMPLE)
    chosen = [text for text in examples for sample in samples if text.split(" = ")[0] == sample.split(" = ")[0]]
    inside = ", ".join([f'name = "{name}"', *(chosen or samples[:2])])
    say(f"In a case file, below [control]: controller = {{ {inside} }}")
    return 0


def print_element(element: type, heading: str, notes: Sequence[str]) -> list[str]:
    """Print heading, docstring, notes and parameters of an element; return an example of each parameter for a case file.

    Formulas of the docstring are converted to plain text, and paragraphs fill the width of the terminal.
    """
    say(heading, style="bold")
    # remove markup for Sphinx
    text = re.sub(r":math:`([^`]*)`", lambda match: plain_formula(match[1]), inspect.getdoc(element) or "")
    for block in re.split(r"\n\s*\n", text):
        lines = " ".join(line.strip() for line in block.splitlines())
        if lines.startswith(".. math::") or block.startswith("    "):
            say(*(f"    {line}" for line in plain_formula(lines.removeprefix(".. math::")).splitlines()))
        elif plain := re.sub(r"``?|:[a-z]+:(?=`)", "", lines):
            say(plain)
    say(*notes)
    return print_parameters(element)


def plain_formula(latex: str) -> str:
    """Convert a LaTeX formula to plain text: fractions with a slash, Greek letters, superscript exponents."""
    text = re.sub(r"\\(?:operatorname)\*?\s*" + GROUP, r" \1 ", latex)
    text = re.sub(r"\\(?:text|mathrm|mathbf|boldsymbol|mathit)\*?\s*" + GROUP, r"\1", text)
    text = re.sub(rf"(\\(?:{FUNCTIONS}))\s*(\\[dt]?frac\s*{GROUP}\s*{GROUP})", r"\1(\2)", text)
    text = re.sub(r"\\begin\{cases\}", "(", text).replace("\\end{cases}", ")").replace("\\\\", ";").replace("&", " if ")
    text = re.sub(r"\\[,;:! ]", " ", text)
    for _ in range(8):  # convert from the innermost braces outwards
        before = text
        text = re.sub(r"\\[dt]?frac\s*" + GROUP + r"\s*" + GROUP, lambda m: f"{_factor(m[1])}/{_factor(m[2])}", text)
        text = re.sub(r"\\[dt]?frac\s*(\w)\s*(\w)", r"\1/\2", text)
        text = re.sub(r"\\sqrt\s*\[3\]" + GROUP, r"(\1)^(1/3)", text)
        text = re.sub(r"\\sqrt\s*" + GROUP, r"√(\1)", text)
        text = re.sub(r"\\ddot\s*" + GROUP, r"\1''", text)
        text = re.sub(r"\\dot\s*" + GROUP, r"\1'", text)
        text = re.sub(r"\\(?:bar|hat|tilde|vec|overline)\s*" + GROUP, r"\1", text)
        text = re.sub(r"\^\s*" + GROUP, lambda m: _power(m[1]), text)
        text = re.sub(r"_\s*" + GROUP, r"_\1", text)
        if text == before:
            break
    text = re.sub(r"\\ddot\s*(\\?\w+)", r"\1''", text)
    text = re.sub(r"\\dot\s*(\\?\w+)", r"\1'", text)
    text = re.sub(r"\\([A-Za-z]+|\|)\s?", _sign, text)
    text = re.sub(r"\^([\d])(?!\w)", lambda m: m[1].translate(SUPERSCRIPTS), text)
    text = text.replace("{", "").replace("}", "").replace("\\", "")
    return "\n".join(filter(None, (re.sub(r"\s+", " ", line).replace("( ", "(").strip() for line in text.split("\n"))))


def _factor(part: str) -> str:
    """Return the numerator or denominator `part` of a fraction, in parentheses if it has several factors."""
    part = part.strip()
    return part if TOKEN.fullmatch(part) else f"({part})"


def _power(exponent: str) -> str:
    exponent = exponent.strip()
    if re.fullmatch(r"-?\d+", exponent):
        return exponent.translate(SUPERSCRIPTS)
    return f"^{exponent}" if re.fullmatch(r"\\?\w+", exponent) else f"^({exponent})"


def _sign(match: re.Match[str]) -> str:
    name, space = match[1], match[0][len(match[1]) + 1 :]
    if name in GREEK_SIGNS:
        return GREEK_SIGNS[name] + (" " if space and match.end() < len(match.string) else "")
    if name in COMMAND_SIGNS:
        return COMMAND_SIGNS[name] + (" " if space and COMMAND_SIGNS[name].strip() else "")
    after = match.string[match.end() : match.end() + 1]
    return name + (" " if space or after.isalnum() or after == "\\" else "")


def print_parameters(element: type) -> list[str]:
    """Print the parameters of an element; return an example of each for a case file."""
    from scissordyn.casefile.table import table_of

    keys, rows = table_of(element).declared_keys(), []
    narrow = console().width < PLAIN_COLUMNS
    for name, key in keys.items():
        quantity = key.quantity
        allowed = quantity.bounds if quantity else "true or false"
        if quantity is None and isinstance(key.default, str):
            allowed = "text"
        default = "required" if key.required else "none" if key.default is None else key.sample
        rows.append((name, default, *((f"{key.help}; {allowed}".strip("; "),) if narrow else (allowed, key.help))))
    if rows:
        more = ("meaning",) if narrow else ("allowed", "meaning")
        print_table({"parameter": "name", "default": "name", **dict.fromkeys(more, "text")}, rows)
    return [f"{name} = {key.sample}" for name, key in keys.items()]


def zoo(
    name: Annotated[str, Argument(help="Name of a mechanism to show.")] = "",
    case: Annotated[bool, Option("--case", help="Print the case file of the mechanism.")] = False,
    copy: Annotated[Path | None, Option("-o", "--output", metavar="FILE", help="Copy the case file to this file.")] = None,
    check: Annotated[
        bool, Option("--check", help="Run it, or all, and compare with reference values; status 3 if one differs.")
    ] = False,
) -> int:
    from scissordyn.collection.catalogue import zoo as entries

    if not name and check and not case and copy is None:
        return max(_check_entry(entry) for entry in entries.values())
    if not name and (case or copy is not None):
        raise InputError(
            "--case or -o without the name of a mechanism", ", ".join(entries), "scissordyn zoo peaucellier --case"
        )
    if not name:
        rows = [(entry.name, entry.title, entry.kind) for entry in entries.values()]
        print_table({"name": "name", "what it is": "text", "kind": "text"}, rows)
        say(*(f"Warning: {problem}." for problem in entries.problems))
        say("Show one: scissordyn zoo peaucellier; its case file: scissordyn zoo peaucellier --case > case.toml")
        return 0
    entry = entries[name]
    if copy is not None:
        _copy(entry.case_file, copy, "a file that is not there", "-o case.toml")
    if case:
        print(entry.text, end="")
    if check:
        return _check_entry(entry)
    if not case and copy is None:
        _show_entry(entry)
    return 0


def _show_entry(entry: Entry) -> None:
    say(entry.title, style="bold")
    say(entry.about, *(f"Source: {reference.text}" for reference in entry.references))
    say(f"Case file: {entry.case_file}", soft_wrap=True)
    say(f"Licence of the files: {entry.licence}")
    rows = [
        (
            number.what + ("" if number.ideal else ", with clearance"),
            number.value,
            number.tolerance,
            f"{number.origin}: {number.reason}",
        )
        for number in entry.numbers
    ]
    print_table({"quantity": "text", "value": "numbers", "tolerance": "numbers", "from": "text"}, rows)
    say(f"Compare a run with them: {command('scissordyn', 'zoo', entry.name, '--check')}")


def _check_entry(entry: Entry) -> int:
    results = entry.check()
    say(entry.title, style="bold")
    rows = []
    for result in results:
        sizes = (result.expected, result.found, result.difference, result.tolerance)
        texts = (short(value, result.unit) for value in sizes)
        rows.append((result.number.what, *texts, "met" if result.met else "differs"))
    print_table(
        {"quantity": "text", **dict.fromkeys(("expected", "found", "difference", "allowed"), "numbers"), "": "text"}, rows
    )
    return DONE if all(result.met for result in results) else UNFINISHED


def examples(
    name: Annotated[str, Argument(help="Name of an example to print.")] = "",
    copy: Annotated[
        Path | None, Option("-o", "--output", metavar="DIR", help="Copy the example, or all, into this folder.")
    ] = None,
) -> int:
    from scissordyn.config.file import folder_of_examples

    folder = folder_of_examples()
    paths = {path.relative_to(folder).with_suffix("").as_posix(): path for path in sorted(folder.rglob("*.toml"))}
    if not paths:
        raise InputError(f"no examples in '{folder}'", "an installation with its examples")
    if name and name not in paths:
        raise InputError(f"no example '{name}'{did_you_mean(name, paths)}", ", ".join(paths), "scissordyn examples paper")
    if copy is not None:
        check_folder(copy, "-o examples")
        every = [path for path in sorted(folder.rglob("*")) if path.suffix in (".toml", ".py")]
        for path in [paths[name]] if name else every:
            target = copy / path.relative_to(folder)
            target.parent.mkdir(parents=True, exist_ok=True)
            _copy(path, target, "a folder without it", "-o examples")
    elif name:
        print(paths[name].read_text(encoding="utf-8"), end="")
    else:
        say(*(f"{key:32}  {_first_sentence(path)}" for key, path in paths.items()))
        say("Print one: scissordyn examples paper > case.toml; copy all: scissordyn examples -o examples")
    return 0


def _copy(source: Path, target: Path, allowed: str, sample: str) -> None:
    """Copy a file of the package; raise `InputError` if the target exists with other content."""
    content = source.read_bytes()
    if not target.exists():
        write_file(target, content, sample=sample)
    elif target.read_bytes() != content:
        raise InputError(f"'{target}' exists with other content", allowed, sample)
    say(target)


def _first_sentence(path: Path) -> str:
    """Return the first sentence of the comment at the top of a file."""
    comment = re.match(r"(?:#.*\n)*", path.read_text(encoding="utf-8"))
    text = " ".join(line.lstrip("# ") for line in comment[0].splitlines()) if comment else ""
    return re.split(r"[:.;] ", text)[0].rstrip(".")


def new(
    structure: Annotated[
        str, Argument(help="scissor, polar, ring, mast, slider-crank, four-bar, n-four-bar, or mechanism.")
    ] = "scissor",
    further: Annotated[
        str,
        Option(
            "--with",
            help="Additional parts with suitable values, such as servo,tip,payload,panels,spring,latch.",
        ),
    ] = "",
    change: Annotated[
        list[str] | None,
        Option(
            "--set",
            metavar="KEY=VALUE",
            help="A value of the file, such as structure.units=5; other values are adapted. Repeatable.",
        ),
    ] = None,
) -> int:
    from scissordyn.config.template import template

    print(template(structure, [name.strip() for name in further.split(",") if name.strip()], change or []), end="")
    return 0


def schema(
    which: Annotated[str, Argument(help="Kind of file: case or study.")] = "case",
    output: Annotated[Path | None, Option("-o", "--output", help="Write the schema to this .json file.")] = None,
) -> int:
    from scissordyn.config.schema import schema as make_schema

    sample = command("-o", f"{which}.json")
    if output is not None:
        if output.suffix.lower() != ".json":
            raise InputError(f"cannot write the schema to '{output}'", "a name that ends in .json", sample)
        check_target(output, sample=sample)
    text = json.dumps(make_schema(which), indent=1, ensure_ascii=False)
    print(text if output is None else write_file(output, f"{text}\n".encode(), sample=sample))
    return 0
