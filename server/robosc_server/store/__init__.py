"""What is kept: jobs and results, in a database."""
