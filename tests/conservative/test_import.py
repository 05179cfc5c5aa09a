import subprocess
import sys

FORBIDDEN = ("numba", "llvmlite", "mujoco", "pinocchio", "heyoka", "pandas", "scipy", "altair")


def test_importing_the_package_imports_no_compiler_no_engine_and_no_tables():
    code = f"import conservative, sys; print([m for m in {FORBIDDEN!r} if m in sys.modules])"
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == "[]"
