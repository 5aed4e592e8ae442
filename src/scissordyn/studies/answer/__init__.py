"""Answers of a study: requirements met, trends, rankings, reports."""
