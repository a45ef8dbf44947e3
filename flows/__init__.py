"""Prefect flows that compose the tasks, their configuration, and the command line."""
