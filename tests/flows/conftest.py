"""Every test with real services looks into their logs when it is over."""

from ..service_logs import expected_in_logs, no_traceback, no_traceback_in_the_end

__all__ = ["expected_in_logs", "no_traceback", "no_traceback_in_the_end"]
