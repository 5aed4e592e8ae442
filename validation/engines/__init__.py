"""Comparison of physics engines on four planar mechanisms: `python -m validation engines`.

Each engine has a file `run_NAME`, which runs in an environment of its own, without scissordyn.
"""
