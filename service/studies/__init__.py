"""What the routes of a kind of study have in common."""
