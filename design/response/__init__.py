"""Exact step responses in time, their metrics, and what they ask of the actuators."""
