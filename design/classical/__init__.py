"""Tab-only classical controllers: their loop, their non-dimensional form, and the search for the fastest gains."""
