// How the corners of what lies on a plane share a contact.
#pragma once

#include "contact/laws/wrench_derivatives.hpp"
#include "shell/faces/flats.hpp"

namespace sphshell {

// A contact that several places of a shell share, all in the frame of a plane, z = 0. A
// displacement of the shell is that of its point at the origin and a rotation about it.
struct SharedContact {
  // A place over the plane, with its share: shares are positive, and their sum is one.
  struct Place {
    Vec3 point;
    double share;
    Matrix36 point_by;
    Row6 share_by;
  };
  int facet, index;  // of the contact, which they name
  double depth;
  Vec3 point;  // the mean of the places
  Row6 depth_by;
  std::vector<Place> places;

  // The mean square of the distance from the point [m^2].
  double spread() const;
};

// With x the places of the shell, d their depths and w their shares, the depth of a contact is
//
//   D = max over w of   sum w d + (mean of |x|^2 - |mean of x|^2 + e (1 - sum w^2)) / (2 R)
//
// as if faces and lines were crowned with a radius R: the maximum of a concave function, so the
// contact moves no faster than R times the tilt. One corner alone has its own depth. See
// docs/laws.md, "Flat faces under other laws".
class Crown {
 public:
  // The most that D is above the depth of the deepest corner [m].
  static double height(const Flats& flats);
  // The contact of the shell's deepest point, where that shares it: false where it is alone. The
  // shell is placed by a rotation and a translation.
  bool share(const Shell& shell, const Flats& flats, const Mat3& turn, const Vec3& at,
             const Contact& deepest, SharedContact& out);

 private:
  // A place that may have a share, as the shell places it.
  struct Candidate {
    int vertex;  // or -1
    Vec3 point;
    Matrix36 point_by;
    Vec3 from;    // the deepest one
    double lead;  // R times how much deeper it is, and half the square of the distance
    double share = 0, solution = 0;  // see Shares
    bool active = false;
  };
  void add(int vertex, const Vec3& point, const Matrix36& point_by);
  bool share_disc(const Flats& flats, const Flats::Disc& disc, const Mat3& turn, const Vec3& at,
                  const Contact& deepest, SharedContact& out) const;
  // The shares of the candidates, which are some; false where one has all.
  bool solve(const Flats& flats, SharedContact& out);

  std::vector<Candidate> candidates_;
};

}  // namespace sphshell
