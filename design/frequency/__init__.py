"""Loops in the frequency domain and the s-plane: transfer, crossovers, margins, bandwidth, poles and root loci."""
