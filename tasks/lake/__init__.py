"""The lake: partitioned Parquet files that a kill can't tear, read with SQL."""
