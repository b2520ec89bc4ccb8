"""Closed loops seen from outside: frequency responses, and what disturbances and sensor noise do to the outputs."""
