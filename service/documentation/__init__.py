"""The documentation of the API: the OpenAPI document, what it shows, and the pages that show it."""
