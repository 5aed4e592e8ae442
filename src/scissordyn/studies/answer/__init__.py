"""What a study says: requirements met, trends, rankings, reports."""
