import pytest


@pytest.fixture
def written(tmp_path):
    def write(text, name="my_body.toml"):
        path = tmp_path / name
        path.write_bytes(text.encode() if isinstance(text, str) else text)
        return path

    return write
