"""The routes, one file a subject. A route reads its parameters, calls one function of the domain, and answers."""
