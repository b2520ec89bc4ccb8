"""Hinge moments of aileron and tab: one interface, and thin-aerofoil theory in closed form behind it."""
