"""A study: what it is made of, what identifies it, its results and their statistics."""
