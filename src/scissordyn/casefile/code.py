"""Classes of the user's in a case file: how they are named, and what stands for them when the file is read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

from scissordyn.casefile.quantity import LEADING_NUMBER, si_value
from scissordyn.components.catalogue import component_class
from scissordyn.errors import InputError, command
from scissordyn.model.record import code_digest, source_of
from scissordyn.plugin.element import SLOTS, Element, element_class
from scissordyn.plugin.user_file import file_digest, origin_of, split_reference

CLASS = "class"  # What the name of a class begins with that is in no file: "class Rubber"


class Code:
    """Of case files: named by their files, from the folder of the case file if they are in it, and executed when read."""

    recorded = False
    """Whether a run carries the text: points may have names that "BODY.POINT" cannot mean, and no other file is read."""

    def __init__(self, folder: Path | None = None, digests: Mapping[str, str] = MappingProxyType({})) -> None:
        self.folder, self.digests = folder, digests

    def of_class(self, part: Any, what: str) -> str:
        """The name of the class of a part of the user's."""
        origin = origin_of(type(part))
        if origin is None:
            name = type(part).__name__
            raise InputError(
                f"{what} of the class '{name}', which was made in Python",
                "a class of the package, or of a file: put it in one and import it from there",
                f"from mine import {name}",
            )
        return self._of_file(*origin)

    def _of_file(self, origin: str, digest: str) -> str:
        file, _, name = origin.rpartition(":")
        path = Path(file)
        if file_digest(path) != digest:
            raise InputError(f"'{path}' has changed since '{name}' was described", "the same file, or a new description")
        if self.folder is not None and path.is_relative_to(self.folder.resolve()):
            path = path.relative_to(self.folder.resolve())
        return f"{path.as_posix()}:{name}"

    def names(self, name: str) -> bool:
        """Whether a name of a law, a controller or a component is that of one of the user's."""
        return ".py:" in name or (name in self.digests and name.startswith(f"{CLASS} "))

    def element(self, slot: str, name: str, parameters: Mapping[str, Any]) -> Any:
        return element_class(slot, self.reference(SLOTS[slot].slot.title, name), self.folder or Path())

    def component(self, name: str, keys: Mapping[str, Any]) -> Any:
        return component_class(self.reference("component", name), self.folder or Path())

    def reference(self, what: str, name: str) -> str:
        """File and name of what is executed; an `InputError` if the case file has another digest of the file."""
        if name in self.digests and file_digest(split_reference(what, name, self.folder)[0]) != self.digests[name]:
            raise InputError(f"'{name.rpartition(':')[0]}' is not the file that the case was written with", "the same file")
        return name


class RecordedCode(Code):
    """Of what a run carries: named by where they are, with digests of their files, or of what they compute."""

    recorded = True

    def __init__(self) -> None:
        super().__init__(None, {})
        self.noted: dict[str, str] = {}
        self.sources: list[str] = []  # Of kernels that are in no file, for the reader

    def of_class(self, part: Any, what: str) -> str:
        origin = origin_of(type(part))
        if origin is not None:
            return self._of_file(*origin)
        kernels = part.declaration.kernels.values()
        self.sources += map(source_of, kernels)
        return self._of_file(f"{CLASS} {type(part).__qualname__}", code_digest([*kernels, type(part).parameters]))

    def _of_file(self, origin: str, digest: str) -> str:
        self.noted[origin] = digest
        return origin


class AllowedCode(Code):
    """Of what a run carries, to run it again: from the files that the user allows, which are known by their digests."""

    recorded = True

    def __init__(self, files: Sequence[Path], digests: Mapping[str, str]) -> None:
        super().__init__(None, digests)
        self.files = files

    def reference(self, what: str, name: str) -> str:
        kind, _, called = name.partition(" ")
        called = called.rpartition(".")[2]
        if kind == CLASS and called:
            raise InputError(
                f"the run uses the Python class '{called}' as a {what}, which was in no file",
                f"a {what} from the catalogue or from a file",
                f"put it in a file and give the {what} as 'mine.py:{called}'",
            )
        place, _, called = name.rpartition(":")
        file, digest = Path(place).name, self.digests.get(name)
        if not digest:
            raise InputError(
                f"the run uses the {what} '{called}' of '{file}' without the digest of that file",
                "a run that scissordyn wrote, which holds the digest",
            )
        digests = {path: _digest_of(path) for path in self.files}
        for path, there in digests.items():
            if there == digest:
                return f"{path.resolve()}:{called}"
        if digests:
            raise InputError(
                f"the run uses the {what} '{called}' of '{file}' with the digest {digest}, and the digest of "
                + ", of ".join(f"'{path}' is {there}" for path, there in digests.items()),
                "the file as it was when the run was made",
            )
        raise InputError(
            f"the run uses the {what} '{called}' of '{file}', which is not executed unless you allow it",
            "naming the file after you have read it",
            f"allow_code={file!r} in Python, or {command('--allow-code', file)}",
        )


def _digest_of(path: Path) -> str:
    if not path.is_file():
        raise InputError(
            f"no file '{path}' for the functions of the run", "a Python file that exists", "--allow-code my_laws.py"
        )
    return file_digest(path)


class AbsentPart:
    """A part of the user's in a run that is only read: its class is not executed, but its name and its numbers are there."""

    place: str
    file: str
    values: Mapping[str, Any]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, AbsentPart) and repr(self) == repr(other)

    def __hash__(self) -> int:
        return hash(repr(self))

    def __repr__(self) -> str:
        return f"{self.place} {type(self).__name__} of {self.file or 'Python'} {dict(self.values)}"


class AbsentCode(Code):
    """Of what a run carries, to read its facts: nothing is executed."""

    recorded = True

    def element(self, slot: str, name: str, parameters: Mapping[str, Any]) -> Any:
        base = SLOTS[slot].slot
        # what it takes is not known: any feed-forward torque, and no sensor
        facts = {**base.defaults, "declaration": Element(base, MappingProxyType({})), "__module__": "user"}
        facts |= {"uses_feed_forward": True, "uses_sensor": False} if slot == "controller" else {}
        return _absent(slot, name, parameters, (AbsentPart, SLOTS[slot]), facts)

    def component(self, name: str, keys: Mapping[str, Any]) -> Any:
        return _absent("component", name, keys, (AbsentPart,), {})


def _absent(place: str, name: str, values: Mapping[str, Any], bases: tuple[type, ...], facts: Mapping[str, Any]) -> AbsentPart:
    file, _, called = name.rpartition(":") if ".py:" in name else ("", "", name.partition(" ")[2])
    numbers = {
        key: si_value(value) if isinstance(value, str) and LEADING_NUMBER.fullmatch(value) else value
        for key, value in values.items()
    }
    about = {"place": place, "file": file, "name": called, "source": "the user", "values": MappingProxyType(numbers)}
    part: AbsentPart = type(called, bases, {**facts, **about})()
    vars(part).update(numbers)
    return part


def code_of(context: Mapping[str, Any]) -> Code:
    """What stands for classes of the user's, by the context of a table."""
    return context.get("code") or Code(context.get("folder", Path()))
