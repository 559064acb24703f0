"""Files of strangers are opened in one way: regular ones alone, and at once."""

import os
import re
import socket
import threading
from pathlib import Path

import pytest

from sphshell_pin.base.atomic.file import write_whole
from sphshell_pin.base.regular_file import open_regular, read_bytes, read_text
from sphshell_pin.errors import ResultError

PACKAGE = Path(__file__).parents[1]


@pytest.fixture(params=["pipe", "socket", "folder", "/dev/null", "/dev/zero", "/proc/self/mem"])
def special(request, tmp_path):
    place = tmp_path / "special"
    if request.param == "pipe":
        os.mkfifo(place)
    elif request.param == "socket":
        with socket.socket(socket.AF_UNIX) as server:
            server.bind(os.path.relpath(place))
    elif request.param == "folder":
        place.mkdir()
    elif not Path(request.param).exists():
        pytest.skip("no such file")
    else:
        place.symlink_to(request.param)
    return place


def test_what_is_no_regular_file_is_refused_at_once(special):
    found = []

    def reading():
        for read in (open_regular, read_bytes, read_text):
            with pytest.raises(OSError, match=r"is a pipe|Is a dir|No such device|output error"):
                read(special)
            found.append(read)

    thread = threading.Thread(target=reading, daemon=True)
    thread.start()
    thread.join(10.0)
    assert len(found) == 3


def test_larger_files_than_stated_are_refused(tmp_path):
    file = tmp_path / "a"
    file.write_bytes(b"\xef\xbb\xbfa\r\nb")
    assert read_text(file) == "a\nb"
    assert read_bytes(file, 7) == b"\xef\xbb\xbfa\r\nb"
    with pytest.raises(OSError, match="more than"):
        read_bytes(file, 6)
    with file.open("wb") as sparse:
        sparse.truncate(1 << 40)
    with pytest.raises(OSError, match=r"it holds 1\.1e\+03 GB, more than 4 GB"):
        read_bytes(file)
    assert read_bytes("/proc/self/stat" if Path("/proc/self/stat").exists() else os.devnull)


def test_a_pipe_that_nobody_reads_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(ResultError, match="a pipe that nobody reads"):
        write_whole(tmp_path / "pipe", b"1")
    reader = os.open(tmp_path / "pipe", os.O_RDONLY | os.O_NONBLOCK)
    write_whole(tmp_path / "pipe", b"1")
    assert os.read(reader, 2) == b"1"
    os.close(reader)


READS = re.compile(
    r"""\bopen\((?!\))|\.read_text\(|\.read_bytes\(|\.open\(|np\.load\(|ET\.parse\(|ZipFile\("""
)
OWN = re.compile(  # the package's own data, the system's files, pipes and what is written
    r"__file__|/proc/|PARTS|TEMPLATE|viewer_script|data_folder|devnull|os\.open\(|\"wb\"|"
    r"open\((source|target)|ZipFile\(file\)|archive\.open\(|Image\.open|webbrowser|def open|"
    r"regular_file\.read|xacro\.open|self\._files|BytesIO"
)


def test_nothing_else_in_the_package_opens_files_for_reading():
    folders = ("sphshell_pin", "robots", "pytest_sphshell_pin")
    files = [path for one in folders for path in (PACKAGE / one).rglob("*.py")]
    for path in (one for one in files if one.name != "regular_file.py"):
        for line in path.read_text(encoding="utf-8").splitlines():
            reads = READS.search(line.replace("open_regular(", ""))
            assert not reads or OWN.search(line), f"{path}: {line.strip()}"
