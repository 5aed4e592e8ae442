"""Loaded shaft in an oil film."""
