"""Represent publications as text and BibTeX, and find them by the source of a law or a mechanism."""

from __future__ import annotations

import re
import tomllib
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

FILE = Path(__file__).parent / "references.toml"

DOI = re.compile(r"10\.\d{4,9}/(?!\.)[^\s}\"'`;,|<>\]]+")

NAMED = re.compile(r"\b(?P<name>[^\W\d_a-z][\w'’-]+(?: (?:de|van|von|da) \w+)?).*?\b(?P<year>1[6-9]\d\d|20\d\d)\b")
"""Pattern of a source that names its first author and year."""

BIBTEX = {"software": "misc", "patent": "misc"}  # BibTeX types of kinds that BibTeX does not have

PLACES = ("journal", "booktitle", "publisher", "school", "institution")

UMLAUTS = str.maketrans({umlaut: f"{plain}e" for umlaut, plain in zip("äöü", "aou", strict=True)})


@dataclass(frozen=True)
class Reference:
    """Publication that is cited."""

    key: str  # BibTeX key
    type: str  # BibTeX type, or "software" or "patent"
    authors: tuple[str, ...]  # "Family, Given"
    title: str
    year: int | None = None
    journal: str = ""  # Empty if unknown
    booktitle: str = ""
    publisher: str = ""
    school: str = ""
    institution: str = ""
    volume: str = ""
    number: str = ""
    pages: str = ""
    doi: str = ""
    isbn: str = ""
    url: str = ""
    version: str = ""
    seen: tuple[str, ...] = ()  # Places at which the DOI was found

    @property
    def verified(self) -> bool:
        """True if the DOI was found at two places."""
        return bool(self.doi) and len(self.seen) > 1

    @property
    def text(self) -> str:
        """Authors, year, title, place of publication and address, on one line."""
        names = [_family(author) for author in self.authors]
        who = ", ".join(names[:-1]) + (" and " if len(names) > 1 else "") + names[-1] if names else ""
        where = ", ".join(getattr(self, place) for place in PLACES if getattr(self, place))
        issue = f"({self.number})" if self.number and self.volume else self.number
        numbers = " ".join(filter(None, (self.volume + issue, f"version {self.version}" if self.version else "")))
        parts = [" ".join(filter(None, (who, str(self.year or "")))), self.title, ", ".join(filter(None, (where, numbers)))]
        ends = [self.pages.replace("-", "–"), f"ISBN {self.isbn}" if self.isbn else "", f"doi:{self.doi}" if self.doi else ""]
        return ". ".join(filter(None, parts)) + "".join(f", {end}" for end in (*ends, self.url) if end) + "."

    @property
    def bibtex(self) -> str:
        """BibTeX entry in ASCII letters."""
        kind = BIBTEX.get(self.type, self.type)
        entries = {"author": " and ".join(self.authors)} if self.authors else {}
        entries["title"] = "{" + self.title + "}"
        names = {"year", "doi", "isbn", "url", "pages", "volume", "number", "version", *PLACES}
        entries |= {name.name: str(getattr(self, name.name)) for name in fields(self) if name.name in names}
        entries["pages"] = self.pages.replace("-", "--")
        if self.type == "patent":
            entries["note"] = f"Patent {self.number}"
        lines = [f"  {name} = {{{_latex(value)}}}," for name, value in entries.items() if value not in ("", "None")]
        return "\n".join([f"@{kind}{{{self.key},", *lines, "}"])


def _family(author: str) -> str:
    return author.partition(",")[0]


ACCENTS = {
    "\u0308": '\\"',
    "\u0301": "\\'",
    "\u0300": "\\`",
    "\u0302": "\\^",
    "\u0303": "\\~",
    "\u030a": "\\r ",
    "\u0327": "\\c ",
}

LETTERS = {
    "ø": "{\\o}",
    "Ø": "{\\O}",
    "ß": "{\\ss}",
    "œ": "{\\oe}",
    "æ": "{\\ae}",
    "&": "\\&",
    "%": "\\%",
    "_": "\\_",
    "–": "--",
}


def _latex(text: str) -> str:
    """Return a text in letters that every BibTeX version reads."""
    if DOI.fullmatch(text) or text.startswith("http"):
        return text
    out: list[str] = []
    for letter in text:
        plain, *accents = list(unicodedata.normalize("NFD", letter))
        accent = ACCENTS.get(accents[0]) if len(accents) == 1 else None
        out.append(f"{{{accent}{plain}}}" if accent else LETTERS.get(letter, letter))
    return "".join(out)


@cache
def bibliography() -> Mapping[str, Reference]:
    """Return every publication of the package by its key."""
    read = tomllib.loads(FILE.read_text(encoding="utf-8"))
    entries: dict[str, Reference] = {}
    for key, values in read.items():
        fields: dict[str, Any] = {name: tuple(value) if isinstance(value, list) else value for name, value in values.items()}
        entries[key] = Reference(key, **fields)
    return MappingProxyType(entries)


def dois(text: str) -> tuple[str, ...]:
    """Return the DOIs in a text, each once, without trailing punctuation."""
    texts = (doi.rstrip(".:") for doi in DOI.findall(text))
    return tuple(dict.fromkeys(doi.rstrip(")") if doi.count(")") > doi.count("(") else doi for doi in texts))


def references(source: str) -> tuple[Reference, ...]:
    """Return the publications that a source of a law or a mechanism names."""
    cited: list[Reference] = []
    for part in source.split(";"):
        doi, named = next(iter(dois(part)), ""), NAMED.search(part)
        if doi:
            cited.append(_by_doi().get(doi.lower()) or _unknown(part.strip(), doi))
        elif named is not None:
            entry = _by_name().get((_plain(named["name"])[0], int(named["year"])))
            cited.append(entry or _unknown(part.strip(), ""))
    return tuple(dict.fromkeys(cited))


@cache
def _by_doi() -> dict[str, Reference]:
    return {entry.doi.lower(): entry for entry in bibliography().values() if entry.doi}


@cache
def _by_name() -> dict[tuple[str, int], Reference]:
    by_name: dict[tuple[str, int], Reference] = {}
    for entry in bibliography().values():
        if entry.year is not None and entry.authors:
            for name in _plain(_family(entry.authors[0])):
                by_name.setdefault((name, entry.year), entry)
    return by_name


def _plain(name: str, compared: int = 9) -> tuple[str, str]:
    """Return a family name in ASCII letters, in both usual spellings: umlauts without dots, or with an e.

    `compared`: number of letters of a family name that are compared; a particle or another author may follow.
    """
    german = name.lower().translate(UMLAUTS)
    both = (re.sub(r"[^a-z]", "", unicodedata.normalize("NFD", spelt)) for spelt in (name.lower(), german))
    first, second = (letters[:compared] for letters in both)
    return first, second


def _unknown(text: str, doi: str) -> Reference:
    """Return a reference for a source that the bibliography does not contain."""
    key = re.sub(r"[^a-z0-9]", "", unicodedata.normalize("NFD", text.lower()))[:24] or "source"
    year = re.search(r"\b(1[6-9]\d\d|20\d\d)\b", text)
    title = text.replace(f"doi:{doi}", "").strip(" ,()") if doi else text
    return Reference(key, "misc", (), title or f"doi:{doi}", int(year[0]) if year else None, doi=doi)
