"""Other libraries that do what `native` does."""
