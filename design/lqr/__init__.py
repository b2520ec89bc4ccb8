"""Concurrent actuation by LQR: weights, Riccati equations with certificates, tracking, and the loop that is flown."""
