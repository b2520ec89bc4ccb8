"""The report of a design: one page of HTML that prints well, made of the documents that the API answers."""
