"""From the domain to the wire: each result becomes a document, radians become degrees, names get their unit."""
