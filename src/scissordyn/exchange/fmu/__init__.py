"""Export a mechanism as a functional mock-up unit (FMU, standard FMI 3.0) with C source."""
