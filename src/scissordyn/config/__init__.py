"""Case files: from TOML with units to the frozen descriptions of `scissordyn.model`."""
