// What a shell can lie on: flat faces, and the lines of cylinders and cones.
#pragma once

#include "shell/shell.hpp"

namespace sphshell {

// A face is one that a plane may touch all over: its outline is convex, and what is beside it does
// not stand out beyond it. Beside a plane each is crowned: see contact/faces/crown.hpp.
struct Flats {
  // A planar face whose outline is a circle.
  struct Disc {
    Vec3 center, axis, east, north;  // right-handed, unit
    double radius;                   // [m]
  };
  // All of a cylinder or cone between two circles about its axis; the tip of a cone is one.
  struct Ruled {
    Vec3 center[2], axis;
    double radius[2];  // [m]
  };

  // Corners of the outlines of polygons, and, per vertex, the polygons that it belongs to.
  std::vector<std::vector<int>> polygons;
  std::vector<std::vector<int>> of_vertex;
  std::vector<Disc> discs;
  std::vector<Ruled> ruled;
  double size = 0;  // of the shell [m]
  // Whether the shell can lie on a flat face of another kind as well, with a notch or rounded
  // corners.
  bool others = false;

  bool any() const { return !(polygons.empty() && discs.empty() && ruled.empty()); }
};

// Of a shell whose curved elements have been made.
Flats find_flats(const Shell& shell);

}  // namespace sphshell
