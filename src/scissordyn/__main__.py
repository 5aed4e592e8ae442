"""Run the command line as a module: ``python -m scissordyn``."""

from scissordyn.cli.entry import run

if __name__ == "__main__":
    run()
