"""Work that takes longer than a request should wait: queued, cut into tasks, run by workers, resumed after a break."""
