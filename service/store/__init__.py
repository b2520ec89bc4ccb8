"""What is kept: designs, jobs, keys and answers, in a database and in content-addressed files beside it."""
