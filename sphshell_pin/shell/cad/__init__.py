"""Surfaces as CAD has them: trimmed faces of STEP, IGES and BREP files, read through OpenCASCADE.

OpenCASCADE crashes or hangs on some files, so the package runs it in a process of its own:
`process.run_in_child` sends a request there, `child` receives it, and `jobs` does it. `options`,
`messages`, `process` and `child` do without OpenCASCADE. The other modules import it at their top,
which takes a second, and run it in the process that calls them: for files that are known to be
good.
"""

from sphshell_pin.shell.cad.options import CAD_SUFFIXES, CadOptions, require_kernel

__all__ = ["CAD_SUFFIXES", "CadOptions", "require_kernel"]
