"""Whether compliant and hard contact give other distributions over the range of a study."""
