"""State feedback when only the angles are measured: rates from filters or a Kalman filter, and what that costs."""
