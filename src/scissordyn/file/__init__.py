"""Output files: NetCDF files of runs, exported tables, PDF reports, checksums, and checks of runs read from files."""
