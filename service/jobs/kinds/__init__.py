"""The kinds of jobs: how each is cut into tasks, worked on, put together and kept."""
