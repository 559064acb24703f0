"""Files and folders that are replaced whole or not at all, whatever ends the process."""

from sphshell_pin.base.atomic.file import atomic_file, atomic_path, write_whole
from sphshell_pin.base.atomic.files import AtomicFolder, FolderInUse

__all__ = ["AtomicFolder", "FolderInUse", "atomic_file", "atomic_path", "write_whole"]
