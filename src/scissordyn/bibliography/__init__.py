"""The one place of bibliographic data: what laws, methods, components, mechanisms and the documentation cite."""
