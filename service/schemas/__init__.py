"""What travels over the wire, written out: requests with their ranges, answers with their fields."""
