"""Pictures of a scene in meshcat: live in a page, or recorded in one HTML file.

Importing this costs nothing: meshcat itself is loaded once something is drawn.
"""

from sphshell_pin.view.arrows import ArrowScale
from sphshell_pin.view.camera import View
from sphshell_pin.view.display import Display
from sphshell_pin.view.live import Live, preview
from sphshell_pin.view.recording import write_recording

__all__ = ["ArrowScale", "Display", "Live", "View", "preview", "write_recording"]
