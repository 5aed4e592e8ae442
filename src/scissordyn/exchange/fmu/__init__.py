"""Generate functional mock-up units (FMI 3.0) of one mechanism as C source."""
