"""The collector leaves out what the start of pytest has made."""

import gc


def pytest_collection_finish():
    """Freeze the objects of modules and collected tests: `time_interleaved` collects before it measures, half a second each."""
    gc.collect()
    gc.freeze()
