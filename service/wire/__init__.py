"""The wire itself: bodies and answers, fields by their pointers, units by their names, and what is refused."""
