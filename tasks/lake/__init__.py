"""The lake: partitioned Parquet files that a kill can't tear, read with SQL."""

from plancurate.tasks.lake.mend import mend
from plancurate.tasks.lake.store import Lake

__all__ = ["Lake", "mend"]
