#!/usr/bin/env bash
# dask-jobqueue 0.9.0 (PyPI), 2026-11-29: importing it replaces the handler of SIGINT, so that Ctrl-C no longer raises KeyboardInterrupt.
#
# Seen: before the import the handler is Python's default_int_handler; after it, one of the package. A program that catches
# KeyboardInterrupt to save its results is ended by SystemExit without a status instead, which the shell sees as 0, so that `program && next` goes on.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check dask-jobqueue==0.9.0 dask==2025.11.0 distributed==2025.11.0
cat > "$folder/handler.py" <<'PY'
import os
import signal

assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
import dask_jobqueue  # noqa: E402

handler = signal.getsignal(signal.SIGINT)
print(f"dask-jobqueue {dask_jobqueue.__version__}: SIGINT goes to {getattr(handler, '__module__', handler)}")
assert handler is not signal.default_int_handler, "the import leaves the handler alone now"
try:
    os.kill(os.getpid(), signal.SIGINT)
except KeyboardInterrupt:
    raise SystemExit("KeyboardInterrupt is raised now")
except SystemExit as ended:
    print(f"SIGINT raised SystemExit with status {ended.code!r}")
    assert ended.code in (0, None), "the status says now that the program was interrupted"
PY
"$folder/venv/bin/python" "$folder/handler.py"
