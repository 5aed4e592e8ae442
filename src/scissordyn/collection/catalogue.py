"""Every mechanism of the zoo by name: the folders beside this file, and those that other packages name by an entry point."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from functools import cached_property
from importlib.metadata import entry_points
from pathlib import Path

from scissordyn.collection.entry import DECLARATION, Entry, read_entry
from scissordyn.errors import InputError, did_you_mean

GROUP = "scissordyn.zoo"  # The group of entry points by which other packages name folders of theirs

HERE = Path(__file__).parent / "entries"


class Zoo(Mapping[str, Entry]):
    """Named mechanisms with sources and numbers, as ``sd.zoo["flores slider-crank"]``.

    Spaces, hyphens, underscores and capital letters make no difference. Another package adds its own by an entry point of the
    group "scissordyn.zoo" that names a folder (a path) with a folder for each mechanism: ``zoo.toml`` and ``case.toml``.
    """

    @cached_property
    def _folders(self) -> dict[str, tuple[Path, str]]:
        return self._found[0]

    @property
    def problems(self) -> tuple[str, ...]:
        """What is wrong with the folders of other packages, which are left out then."""
        return self._found[1]

    @cached_property
    def _found(self) -> tuple[dict[str, tuple[Path, str]], tuple[str, ...]]:
        by_name = {folder.name: (folder, "scissordyn") for folder in _entries(HERE)}
        wrong = []
        for point in entry_points(group=GROUP):
            package = point.dist.name if point.dist is not None else point.name
            try:
                folders = _entries(Path(point.load()))
            except Exception as error:  # of somebody else's package: the rest can be used without it
                wrong.append(f"{package}: {type(error).__name__}: {error}")
                continue
            for folder in folders:
                if folder.name in by_name:
                    wrong.append(f"{package}: '{folder.name}' is the name of a mechanism of {by_name[folder.name][1]}")
                else:
                    by_name[folder.name] = (folder, package)
        return dict(sorted(by_name.items())), tuple(wrong)

    def __getitem__(self, name: str) -> Entry:
        names = {_plain(entry): entry for entry in self._folders}
        if _plain(str(name)) not in names:
            near = did_you_mean(str(name), self._folders)
            raise InputError(f"no mechanism '{name}' in the zoo{near}", ", ".join(self._folders), "scissordyn zoo")
        folder, package = self._folders[names[_plain(str(name))]]
        return read_entry(folder, package)

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and _plain(name) in map(_plain, self._folders)

    def __iter__(self) -> Iterator[str]:
        return iter(self._folders)

    def __len__(self) -> int:
        return len(self._folders)

    def __repr__(self) -> str:
        return f"<zoo of {len(self)} mechanisms: {', '.join(self)}>"


def _plain(name: str) -> str:
    return re.sub(r"[\s_-]+", "-", name.strip()).lower()


def _entries(folder: Path) -> list[Path]:
    entries = sorted(path.parent for path in folder.glob(f"*/{DECLARATION}"))
    if not entries:
        raise InputError(f"'{folder}' has no folder with a {DECLARATION}", "the folder of some mechanisms")
    return entries


zoo = Zoo()
"""The mechanisms that come with the package and with others that are installed."""
