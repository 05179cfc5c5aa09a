"""Wheels to install from without a network: a test engine of one file, and the installed NumPy."""

import hashlib
import zipfile
from base64 import urlsafe_b64encode
from importlib import metadata

TAG = "py3-none-any"
INFO = "Metadata-Version: 2.1\nName: {}\nVersion: {}\n"
WHEEL = "Wheel-Version: 1.0\nGenerator: tests\nRoot-Is-Purelib: true\nTag: {}\n"
SETUP = """from pathlib import Path
Path({!r}).write_text("it ran")
from setuptools import setup
setup(name="trial", version="3.0")
"""


def write_wheel(folder, version, tag=TAG, code="VALUE = 1\n", name="trial"):
    """Write the wheel of a package of one file."""
    info = f"{name}-{version}.dist-info"
    files = {f"{name}.py": code, f"{info}/METADATA": INFO.format(name, version), f"{info}/WHEEL": WHEEL.format(tag)}
    write_zip(folder / f"{name}-{version}-{tag}.whl", {path: text.encode() for path, text in files.items()}, info)


def write_numpy(folder):
    """Write a wheel of the installed NumPy."""
    package = metadata.distribution("numpy")
    info = f"numpy-{package.version}.dist-info"
    paths = [path for path in package.files if path.parts[0] in ("numpy", "numpy.libs", info) and path.suffix != ".pyc"]
    tag = next(line.partition(": ")[2] for line in package.read_text("WHEEL").splitlines() if line.startswith("Tag: "))
    left_out = ("RECORD", "INSTALLER", "REQUESTED", "direct_url.json")  # written by who installs
    files = {str(path): path.locate().read_bytes() for path in paths if path.name not in left_out}
    write_zip(folder / f"numpy-{package.version}-{tag}.whl", files, info)


def write_zip(path, files, info):
    rows = [f"{name},sha256={digest(data)},{len(data)}" for name, data in files.items()]
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in files.items():
            archive.writestr(name, data)
        archive.writestr(f"{info}/RECORD", "\n".join([*rows, f"{info}/RECORD,,"]))


def digest(data):
    return urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()


def write_sdist(folder, marker):
    """Write a source distribution whose setup.py writes a file."""
    import io
    import tarfile

    texts = {"setup.py": SETUP.format(str(marker)), "PKG-INFO": INFO.format("trial", "3.0")}
    with tarfile.open(folder / "trial-3.0.tar.gz", "w:gz") as archive:
        for name, text in texts.items():
            entry = tarfile.TarInfo(f"trial-3.0/{name}")
            entry.size = len(text)
            archive.addfile(entry, io.BytesIO(text.encode()))
