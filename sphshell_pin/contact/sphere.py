"""A sphere on a link of the robot."""

from dataclasses import dataclass

from sphshell_pin.base.checks import check_name, check_positive, check_vector


@dataclass(frozen=True)
class Sphere:
    """A sphere of `radius` [m] at `offset` (3,) [m] from the origin of `frame`, in that frame."""

    radius: float
    frame: str
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        """Raise InvalidParameter for a radius that is not positive, or another type."""
        check_name("frame", self.frame)
        object.__setattr__(self, "radius", check_positive("radius", self.radius, "m"))
        offset = (0.0, 0.0, 0.0) if self.offset is None else self.offset
        x, y, z = check_vector("offset", offset, 3).tolist()
        object.__setattr__(self, "offset", (x, y, z))
