"""Starting, watching and flushing the servers that flows use."""
