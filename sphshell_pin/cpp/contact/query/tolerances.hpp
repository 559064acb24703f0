// All tolerances of contact/, each with its unit and reason; tests/contact/test_tolerances.py shows
// what they are sensitive to.
#pragma once

namespace sphshell {

// Round-off of a coordinate, as a share of shell size + radius. Regions of features overlap by this
// much, so that no position falls between two of them; what is found twice is then merged.
constexpr double kRoundOff = 1e-14;

// "facets": two minima of the distance closer than this share of the radius are one.
constexpr double kSamePoint = 1e-10;
// ... and a minimum this much farther from a vertex that fans share, but no side, is still at it:
// the others are within the former distance of it, where the angle between them is not below 0.01
// rad.
constexpr double kPinched = 100;
// "smooth": closest points of two cells nearer than this share of the radius are one.
constexpr double kSamePlace = 1e-8;

// A contact's normal is taken from the surface where the distance is below this share of the
// radius: the direction to the center is round-off there.
constexpr double kAtSurface = 1e-9;

// Newton's iterations on a cell end with the step after one below this, in its parameters: errors
// square, so that the last step is at round-off.
constexpr double kLastStep = 1e-7;
constexpr int kMostIterations = 20;

// A stationary point counts this far outside its cell, in its parameters, so that none falls
// between two cells; the one found twice is absorbed by the saddle between them, which is as deep.
constexpr double kOverlap = 1e-9;

// A cell is searched by one run of Newton's method where the second derivative of |x - c|^2 / 2 is
// certainly above this (1: a plane). Below, it is divided.
constexpr double kConvex = 0.05;

// Parts of a cell are no longer divided where they cannot be nearer than what is known by more than
// this share of the depth (the potential changes by 2.5 times this share: far below 1e-6), ...
constexpr double kLevel = 1e-7;
// ... or after so many halvings, which slivers reach: the best descent from all parts is taken.
constexpr int kMostHalvings = 3;

// Parts of a side are no longer divided where the square of the distance varies by less than this
// share: the depth is exact to half of it.
constexpr double kLevelSide = 1e-14;
// Round-off of the derivative's coefficients, as a share of distance times length.
constexpr double kQuinticRoundOff = 4e-16;

// A saddle no shallower than the shallower minimum, to this share of the radius, separates nothing.
constexpr double kNoSaddle = 1e-13;

// What is no more than this share of the shell's size above the lowest point of a face on a plane
// is level with it, and a saddle no more below it is none: far more than round-off, so that a box
// stays on its face and a roller on its line.
constexpr double kLevelFace = 1e-9;

// Shown as one contact, not summed as one: two minima where the saddle between them is no more
// than this share of its depth below both (between flat elements, whose angles are meant, the
// smaller share), and whose normals differ from its by no more than kAlike [rad].
constexpr double kShallow = 1e-2, kShallowFlat = 1e-4, kAlike = 0.03;

}  // namespace sphshell
