"""One process that reads the model files of all tests: each reading has one of its own otherwise, which imports engines."""

import pytest

from conservative.references.model_files import readers
from conservative.references.worker.calls import python_worker


class Shared:
    """A worker that other tests use as well, so that closing it does nothing."""

    def __init__(self, worker):
        self.ask = worker.ask

    def close(self):
        pass


@pytest.fixture(scope="session")
def reading_worker():
    worker = python_worker({"OPENBLAS_NUM_THREADS": "1"}, readers.MEMORY)
    yield worker
    worker.close()


@pytest.fixture
def shared_reader(reading_worker, monkeypatch):
    monkeypatch.setattr(readers, "python_worker", lambda *_: Shared(reading_worker))
