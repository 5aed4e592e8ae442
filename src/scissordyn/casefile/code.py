"""User-defined classes in a case file: how they are named, and whether their files are executed when the case is read."""

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

CLASS_PREFIX = "class"  # first word, in a stored run, for a user-defined class without a file: "class Rubber"


class Code:
    """Names and files of the user-defined classes in a user's case file; the files are executed when the case is read.

    A class is named by its file, relative to the folder of the case.
    """

    recorded = False
    """True for the text stored in a run: names of points may hold a dot, and no other file is read."""

    def __init__(self, folder: Path | None = None, digests: Mapping[str, str] = MappingProxyType({})) -> None:
        self.folder, self.digests = folder, digests

    def of_class(self, part: Any, what: str) -> str:
        """Return the name of the class of a user-defined part."""
        origin = origin_of(type(part))
        if origin is None:
            name = type(part).__name__
            raise InputError(
                f"{what}: its class '{name}' is not in a file",
                "a class of the package, or a class imported from a file",
                f"from mine import {name}",
            )
        return self._of_file(*origin)

    def _of_file(self, origin: str, digest: str) -> str:
        file, _, name = origin.rpartition(":")
        path = Path(file)
        if file_digest(path) != digest:
            raise InputError(
                f"'{path}' has changed since '{name}' was imported", "the file as it was, or a new import of the class"
            )
        if self.folder is not None and path.is_relative_to(self.folder.resolve()):
            path = path.relative_to(self.folder.resolve())
        return f"{path.as_posix()}:{name}"

    def names(self, name: str) -> bool:
        """Return True if the name of a law, controller or component refers to a user-defined class."""
        return ".py:" in name or (name in self.digests and name.startswith(f"{CLASS_PREFIX} "))

    def element(self, slot: str, name: str, parameters: Mapping[str, Any]) -> Any:
        return element_class(slot, self.reference(SLOTS[slot].slot.title, name), self.folder or Path())

    def component(self, name: str, keys: Mapping[str, Any]) -> Any:
        return component_class(self.reference("component", name), self.folder or Path())

    def reference(self, what: str, name: str) -> str:
        """Return the reference "file.py:name" of the code to execute; raise `InputError` if the file's digest differs."""
        if name in self.digests and file_digest(split_reference(what, name, self.folder)[0]) != self.digests[name]:
            raise InputError(f"'{name.rpartition(':')[0]}' has changed since the case was written", "the file as it was")
        return name


class RecordedCode(Code):
    """Names of the user-defined classes in the case file that a run stores: absolute paths of their files, with digests."""

    recorded = True

    def __init__(self) -> None:
        super().__init__(None, {})
        self.noted: dict[str, str] = {}
        self.sources: list[str] = []  # source texts of kernels that no file defines, as information for a reader

    def of_class(self, part: Any, what: str) -> str:
        origin = origin_of(type(part))
        if origin is not None:
            return self._of_file(*origin)
        kernels = part.declaration.kernels.values()
        self.sources += map(source_of, kernels)
        return self._of_file(f"{CLASS_PREFIX} {type(part).__qualname__}", code_digest([*kernels, type(part).parameters]))

    def _of_file(self, origin: str, digest: str) -> str:
        self.noted[origin] = digest
        return origin


class AllowedCode(Code):
    """User-defined classes of a saved run that is repeated; executes only files that the user allows, if unchanged."""

    recorded = True

    def __init__(self, files: Sequence[Path], digests: Mapping[str, str]) -> None:
        super().__init__(None, digests)
        self.files = files

    def reference(self, what: str, name: str) -> str:
        kind, _, called = name.partition(" ")
        called = called.rpartition(".")[2]
        if kind == CLASS_PREFIX and called:
            raise InputError(
                f"the run uses the Python class '{called}' as a {what}, which is not in a file",
                f"a {what} from the catalogue or from a file",
                f"put it in a file and give the {what} as 'mine.py:{called}'",
            )
        place, _, called = name.rpartition(":")
        file, digest = Path(place).name, self.digests.get(name)
        if not digest:
            raise InputError(
                f"the run uses the {what} '{called}' of '{file}', but does not contain the digest of that file",
                "a run that scissordyn wrote, with the digest",
            )
        digests = {path: _digest_of(path) for path in self.files}
        for path, there in digests.items():
            if there == digest:
                return f"{path.resolve()}:{called}"
        if digests:
            raise InputError(
                f"the run uses the {what} '{called}' of '{file}' with the digest {digest}, but the digest of "
                + ", of ".join(f"'{path}' is {there}" for path, there in digests.items()),
                "the file as it was when the run was made",
            )
        raise InputError(
            f"the run uses the {what} '{called}' of '{file}', which is not executed unless you allow it",
            "the name of that file, after you have read it",
            f"allow_code={file!r} in Python, or {command('--allow-code', file)}",
        )


def _digest_of(path: Path) -> str:
    if not path.is_file():
        raise InputError(
            f"the file '{path}' with functions of the run does not exist", "an existing Python file", "--allow-code my_laws.py"
        )
    return file_digest(path)


class AbsentPart:
    """Placeholder for a user-defined part of a saved run whose code is not executed: only its name and values are known."""

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
    """User-defined code of a saved run that is only shown; placeholders replace its parts, and no code is executed."""

    recorded = True

    def element(self, slot: str, name: str, parameters: Mapping[str, Any]) -> Any:
        base = SLOTS[slot].slot
        # the class is unknown: the placeholder accepts any feed-forward torque, and no sensor
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
    """Return the `Code` in the context of a table, by default one that executes files of the case's folder."""
    return context.get("code") or Code(context.get("folder", Path()))
