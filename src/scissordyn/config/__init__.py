"""Case files: TOML with units in, the frozen descriptions of `scissordyn.model` out."""
