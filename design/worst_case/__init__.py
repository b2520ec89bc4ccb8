"""The largest output that references of bounded size and rate can cause, proved from above, reached from below."""
