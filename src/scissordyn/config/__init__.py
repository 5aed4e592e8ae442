"""Case and study files: reading TOML with units into the frozen descriptions of `scissordyn.model` and `scissordyn.studies`."""
