"""A loaded shaft in an oil film."""
