"""Load cases in time: run, record, judge."""
