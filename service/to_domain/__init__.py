"""From the wire to the domain: each part of a request becomes its dataclass, in SI and radians."""
