"""Bibliographic data of all publications that laws, methods, components, mechanisms and the documentation cite."""
