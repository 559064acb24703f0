"""Surfaces as CAD has them: trimmed faces of STEP, IGES and BREP files, read through OpenCASCADE.

The modules here import OpenCASCADE at their top, which takes a second; they are imported by the
functions that need them, after `require_kernel`.
"""

from __future__ import annotations

from sphshell_pin.shell.cad.options import CAD_SUFFIXES, CadOptions, require_kernel

__all__ = ["CAD_SUFFIXES", "CadOptions", "require_kernel"]
