"""Robustness of a loop with two inputs against changes of both at once."""
