"""User-defined elements: contact laws, friction laws, components and controllers written as Python functions."""
