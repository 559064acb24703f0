// Inside of creases.cpp and crease_evidence.cpp: what is known of every edge while creases are
// sought.
#pragma once

#include "shell/curved/creases.hpp"

namespace sphshell {

// Coordinates are known to this share of the box at best: single precision.
constexpr double kRounded = 1.2e-7;

// The surface at one side of an element, estimated from that element alone.
struct SideEstimate {
  float turn;       // from its plane to the side [rad], > 0 convex
  float curvature;  // across the side [1/m]
  float height;     // of the opposite corner over the side [m]
  bool known;       // there are elements beyond the opposite corner
};

// An edge. Single precision: there is one for every edge of the surface at a time.
struct Joint {
  Eigen::Vector3f direction;
  int half_edge[2];  // none where < 0: an edge that is no joint of two elements wound alike
  float angle;       // [rad], > 0 convex
  bool exists() const { return half_edge[0] >= 0; }
};

// The side of a joint that bends more, of those that are known.
inline int curved_side(const std::array<SideEstimate, 2>& estimates) {
  const auto& [a, b] = estimates;
  return a.known && (!b.known || std::abs(a.curvature) >= std::abs(b.curvature)) ? 0 : 1;
}

// Divides fans of normals where the elements show a crease.
class CreaseSearch {
 public:
  CreaseSearch(const Shell& shell, std::vector<Vec3> normals, bool given, const Faces& faces)
      : shell_(shell), given_(given), faces_(faces), original_(std::move(normals)) {
    list_joints();
    start();
  }

  // The normals after that; to be called once.
  CornerNormals divide();

 private:
  const std::vector<Vec3>& points() const { return shell_.vertices(); }
  int vertex(int corner) const { return shell_.vertex(corner); }
  const Vec3& point(int corner) const { return shell_.point(corner); }
  bool is_known(int corner) const { return faces_.of_triangle(corner / 3) >= 0; }
  bool has_known(Span corners) const {
    return std::any_of(corners.first, corners.last, [&](int c) { return is_known(c); });
  }
  // Whether the faces at both sides of a joint are known.
  bool is_settled(std::size_t e) const {
    return is_known(joints_[e].half_edge[0]) && is_known(joints_[e].half_edge[1]);
  }
  // The corner opposite a half-edge.
  static int opposite(int h) { return corner_before(h); }

  void list_joints();
  void start();
  // Joined where there is no crease by now; kept until crease_ changes.
  const Fans& fans();
  // Fills divided_normals_ and divided_ by those fans.
  void divide_normals();
  const std::vector<Vec3>& normals() const {
    return divided_normals_.empty() ? original_ : divided_normals_;
  }
  void forget_fans() { fans_.reset(), divided_normals_.clear(), divided_.clear(); }
  SideEstimate estimate_side(const Fans& fans, int h) const;
  bool reaches_beyond(const Fans& fans, int h) const;
  // Fills what is known of each joint, from estimates of both its sides.
  void classify_joints();
  void weigh_runs();
  float count_along(int vertex, const Eigen::Vector3f& direction,
                    const std::vector<char>& joints) const;
  bool add_creases();
  template <class May>
  void extend_lines(std::vector<int> ends, May&& may);
  void separate_straight_walls();
  void lean_as_other_ends(const Fans& fans);

  template <class Visit>
  void at_vertex(int vertex, Visit&& visit) const {
    const Topology& topology = shell_.topology();
    for (int i = topology.neighbor_begin[vertex]; i < topology.neighbor_begin[vertex + 1]; ++i)
      visit(edge_at_[i]);
  }

  const Shell& shell_;
  bool given_;
  const Faces& faces_;
  std::vector<Vec3> original_, divided_normals_;  // the latter where they differ
  std::vector<int> original_count_;               // per corner: of its fan before it was divided
  std::vector<char> divided_;                     // per corner
  std::vector<char> independent_;                 // per corner, of given normals
  LargeArray<Joint> joints_;                      // per edge
  LargeArray<int> edge_at_;                       // beside Topology::neighbors
  std::vector<char> crease_;                      // per edge, as all that follows
  std::vector<char> explained_, alike_, core_, smooth_;
  std::vector<float> off_, evidence_;
  std::vector<std::array<float, 2>> run_;  // evidence beyond either side
  LargeArray<std::array<SideEstimate, 2>> estimates_;
  std::optional<Fans> fans_;
};

}  // namespace sphshell
