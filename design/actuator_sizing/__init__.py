"""Which actuator is enough: candidates behind their gears against what the envelope asks for (seed 6.3.2)."""
