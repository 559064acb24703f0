// Inside of recognition.cpp, guesses.cpp, growth.cpp, evidence.cpp, steps.cpp, agreement.cpp and
// snapping.cpp: the search for faces in a mesh.
#pragma once

#include <map>

#include "shell/faces/recognition.hpp"

namespace sphshell {

// The upper one of two; reorders the values.
inline double median(std::vector<double>& values) {
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Without interpolation.
inline double quantile(std::vector<double> values, double share) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * double(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// The place of a point on a shape with an axis: its angle around it [rad], its distance from it
// [m], and what is constant on a circle about the axis: on a torus the angle of the tube [rad],
// else the height [m].
struct Place {
  double around, off, across;
};

inline Place place_on(const Primitive& s, const Vec3& x) {
  const Vec3 u = s.axis.unitOrthogonal(), y = x - s.point;
  const double a = y.dot(u), b = y.dot(s.axis.cross(u)), off = std::hypot(a, b);
  const double height = y.dot(s.axis);
  return {std::atan2(b, a), off,
          s.kind == FaceKind::Torus ? std::atan2(height, off - s.radius) : height};
}

// Which way a facet is turned in the parameters of a shape, seen along the shape's normals: 1 or
// -1; 0 where its corners are on one line there within the tolerance, as those of a cap are. The
// normal of a needle may lie in the surface; that its corners are counter-clockwise in the
// parameters holds for each facet of a mesh.
int turned_on(const Primitive& shape, const std::array<Vec3, 3>& corners, double tolerance);

// The cylinder, cone or torus with a known axis through `point`: its radii follow from points.
Primitive with_axis(FaceKind kind, const Vec3& point, const Vec3& axis,
                    const std::vector<Vec3>& points);

// Per vertex the faces that its triangles lie on, each once, in the order of the triangles.
std::vector<std::vector<int>> faces_at_vertices(const Shell& shell, const Faces& faces);

// Fits tangent round faces once more so that they agree on their borders; planes stay.
void agree_on_borders(const Shell& shell, Faces& faces, double tolerance);

// A connected part of the mesh that a primitive explains.
struct Growth {
  Primitive shape;
  std::vector<int> triangles;
  int sign = 1;          // of the triangles' normals along the shape's
  double deviation = 0;  // of the flat sides from the shape, the largest [m]
  double window = 0;     // the vertices are as close as that to the shape [m]
  // Triangles that lean or stand off more than the others; regions wider than the regular step.
  std::vector<int> left_out = {}, wide = {};
  double explained = 0;  // triangles, with those that stay on other faces
};

enum class Inscribed : char { No, Plane, Belt };

// Finds faces from seeds: a patch, a fit, growth over all that it explains, evidence.
class Recognizer {
 public:
  Recognizer(const Shell& shell, const CoplanarRegions& regions, double tolerance);

  // To be called once.
  Faces run();

 private:
  // What one triangle says of a primitive.
  struct Explained {
    bool explained, leans;  // its normal says nothing
    int sign;
    double deviation;
  };

  const Triangle& corners(int t) const { return shell_.triangles()[t]; }
  const Vec3& point(int vertex) const { return shell_.vertices()[vertex]; }
  const Vec3& facet_normal(int t) const { return shell_.topology().face_normal[t]; }
  // Of a triangle [m, m^2, m].
  Vec3 centroid(int t) const;
  double area(int t) const;
  double longest_side(int t) const;
  // Of its corners from a shape, the largest distance [m].
  double off(int t, const Primitive& shape) const;
  // The angle between the normals of two [rad].
  double turn(int t, int u) const { return angle_between(facet_normal(t), facet_normal(u)); }
  // Each once, ascending.
  std::vector<int> vertices_of(const std::vector<int>& triangles) const;
  FacetSample sample(const std::vector<int>& triangles) const;
  // These alone are marked from now on.
  void mark(const std::vector<int>& triangles);
  bool is_own_plane(int t) const { return inscribed_[regions_.of(t)] == Inscribed::Plane; }
  bool is_marked(int t) const { return mark_[t] == round_; }
  // Calls visit(u) for what is beside triangles across a smooth side, and not marked when its turn
  // comes.
  template <class Visit>
  void for_each_beside(const std::vector<int>& triangles, Visit&& visit) const {
    for (const int t : triangles)
      for (int k = 0; k < 3; ++k)
        if (const int u = beside_[3 * t + k]; u >= 0 && !is_marked(u)) visit(u);
  }

  // growth.cpp
  Explained explain(int t, const Primitive& shape, double tolerance) const;
  double lean(int t, const Primitive& shape) const;
  // The connected triangles that a shape explains; the shape fitted to them; both in turn.
  Growth grow(int seed, const Primitive& shape, double tolerance);
  bool refit(Growth& growth) const;
  Growth grow_and_refit(int seed, const Primitive& shape);
  void leave_own_faces_out(Growth& growth);
  void absorb(int face);

  // steps.cpp
  // The widest regular step of a face [rad], and by the region beyond that of oblique ends.
  struct Steps {
    double equal;
    std::map<int, double> before;
  };
  Steps widest_steps(const Growth& growth);
  double slack(const Growth& growth, double step) const;
  void leave_wide_bands_out(Growth& growth);

  // evidence.cpp
  std::vector<int> inner_vertices(const Growth& growth);
  // Whether its border leaves the shape slowly; whether its vertices determine the shape, with some
  // to spare; whether it is a strip without vertices inside.
  bool drifts_away(const Growth& growth);
  bool is_over_determined(const Growth& growth);
  bool is_weak(const Growth& growth);

  // guesses.cpp
  std::vector<int> patch(int seed, std::size_t vertices, bool along, int beside = -1);
  bool try_shape(int seed, const Primitive& guess, Growth& best, double& score);
  bool try_kinds(int seed, const std::vector<int>& patch, bool torus, bool others, Growth& best,
                 double& score);
  void try_ring(int seed, Growth& best, double& score);
  // Whether a face was found from this triangle.
  bool recognize_from(int seed);
  void recognize_rims(int face);
  // Vertices that are rounded more coarsely than in single precision do not tell rims from strips.
  bool is_precise() const { return sphshell::is_precise(shell_, tolerance_); }

  // recognition.cpp
  bool is_fruitless() const;  // too many
  // Fills beside_, turn_ and curved_: the triangles that a face other than a plane may have.
  void find_candidates();
  // Whether it was taken.
  bool take(Growth growth);
  void drop_zones_of_free_shapes();
  double reach_across(int half_edge) const;  // [m]
  void add_planes(Faces& faces) const;

  const Shell& shell_;
  const CoplanarRegions& regions_;
  const double tolerance_, wide_;
  std::vector<int> beside_;   // per half-edge: the triangle across a smooth edge, else -1
  std::vector<float> turn_;   // per triangle: the largest turn at its smooth edges [rad]
  std::vector<char> curved_;  // per triangle: may belong to a curved face
  std::vector<char> tries_;   // per triangle: in how many failures
  std::vector<int> of_;       // per triangle: in faces_
  // Per coplanar region: inscribed in a round face, but a plane of its own, or part of a belt.
  std::vector<Inscribed> inscribed_;
  std::vector<Growth> faces_;  // triangles as they were found; others may have taken some since
  std::vector<int> mark_;
  int round_ = 0;
  std::size_t visits_ = 0;     // of triangles, by all growths
  std::size_t fruitless_ = 0;  // of those, by growths that led to nothing
};

}  // namespace sphshell
