"""Case and study files: read TOML with units as mechanisms, options and studies, and write case files and templates."""
