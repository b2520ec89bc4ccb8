"""Loops with transport delays: their exact poles, proofs that none is missing, and their responses in time."""
