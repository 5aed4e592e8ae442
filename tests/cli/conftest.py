"""A folder to type commands in, and what they say where they fail."""

import pytest

from scissordyn.cli.main import status_of


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return an empty folder, which is the current folder of the test."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def said(capfd):
    """Return a function that runs a command and returns status and stderr, which is one line if it fails and else empty."""

    def typed(*arguments):
        status = status_of(arguments)
        shown = capfd.readouterr()
        assert status in (0, 2, 3), (arguments, shown.err)
        assert shown.err.count("\n") == (0 if status == 0 else 1), (arguments, shown.err)
        assert "Traceback" not in shown.err
        assert not any(word in shown.out for word in ("LAPACK", "** On entry"))
        return status, shown.err

    return typed


@pytest.fixture
def refused(capfd):
    """Return a function that runs a command with bad input, checks that its status is 2, and returns its line on stderr."""

    def typed(*arguments):
        capfd.readouterr()
        assert status_of(arguments) == 2
        shown = capfd.readouterr()
        assert shown.out == ""
        assert shown.err.startswith("scissordyn: ")
        assert shown.err.count("\n") == 1
        assert shown.err[:-1].isprintable()
        return shown.err

    return typed
