// Spheres on the axis of a face or of a round border: they touch all of a circle alike.
#pragma once

#include "contact/query/minimum.hpp"

namespace sphshell {

// Marks the minima that stand for a whole circle about an axis: those on cylinders, cones and tori
// that no border cuts there, and those whose sides are all of a round border.
void find_rings(const Shell& shell, const Sphere& sphere, std::vector<Minimum>& minima);

// What is shown of a minimum that is marked. The depth is that of the nearest point, so that its
// gradient jumps as the center crosses the axis: on the axis it is the mean of the normals all
// around, Clarke's subgradient of least norm, and goes over to that of the nearest point within
// kOnRing of the circle's radius.
Contact ring_of(const Minimum& minimum, const Sphere& sphere);

}  // namespace sphshell
