import pytest


@pytest.fixture
def written(tmp_path):
    def write(data):
        path = tmp_path / "m.tvlog"
        path.write_bytes(data)
        return str(path)
    return write
