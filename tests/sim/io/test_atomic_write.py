"""Files appear whole or not at all, errors name the file, and what a killed process left is removed."""

import errno
import os
import subprocess
import sys

import pytest

from sim.io.atomic_write import PREFIX, atomic_write


def test_a_full_disk_names_the_file_and_keeps_the_old_one(tmp_path):
    path = tmp_path / "out.bvh"
    path.write_text("precious")
    with pytest.raises(OSError) as caught, atomic_write(path):
        raise OSError(errno.ENOSPC, "No space left on device")
    assert caught.value.filename == str(path) and caught.value.errno == errno.ENOSPC
    assert path.read_text() == "precious" and [each.name for each in tmp_path.iterdir()] == ["out.bvh"]


def test_a_folder_that_is_not_there_is_an_error_of_the_file(tmp_path):
    with pytest.raises(FileNotFoundError) as caught, atomic_write(tmp_path / "nowhere" / "out.bvh"):
        pass
    assert caught.value.filename == str(tmp_path / "nowhere" / "out.bvh")


@pytest.mark.skipif(sys.platform == "win32", reason="there nobody can be asked whether he lives")
def test_what_a_killed_process_left_is_removed_and_what_another_writes_is_not(tmp_path):
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    left, living = (tmp_path / f"{PREFIX}{number}-abc" for number in (gone.pid, os.getppid()))
    for folder in (left, living):
        folder.mkdir()
        (folder / "half.bvh").write_text("half")
    with atomic_write(tmp_path / "out.bvh") as temporary:
        temporary.write_text("whole")
    assert sorted(each.name for each in tmp_path.iterdir()) == [living.name, "out.bvh"]
