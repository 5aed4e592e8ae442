"""The one driver: mechanism, consistent start, advance, Dataset."""
