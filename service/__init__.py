"""The wire: the HTTP service around `schedules.run`."""
