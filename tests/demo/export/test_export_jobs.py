"""The process that exports does not outlive a window that died."""

import subprocess
import sys

SCRIPT = """import multiprocessing, os
from concurrent.futures import ProcessPoolExecutor
from demo.export.export_jobs import _start_writing

if __name__ == "__main__":
    pool = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), initializer=_start_writing)
    print(pool.submit(os.getpid).result(), flush=True)
    os._exit(1)  # the window dies
"""
TOO_LONG = 120  # seconds after which the export is known to hang; nothing is measured by it


def test_an_export_ends_when_its_window_has_died(tmp_path):
    (tmp_path / "window.py").write_text(SCRIPT)
    done = subprocess.run([sys.executable, tmp_path / "window.py"], capture_output=True, text=True, timeout=TOO_LONG)
    assert done.stdout.strip().isdigit(), "its output ends only when both have ended"
