"""Non-linear simulation of closed loops over the grid: total hinge moments, limits, friction, freeplay, delays."""
