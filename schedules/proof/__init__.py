"""Proof between the grid points: a schedule's closed loop decays in all of a cell."""
