// The curvature of the surface that curved elements were made from.
#pragma once

#include <unordered_map>

#include "contact/query/contact.hpp"
#include "shell/curved/curved.hpp"
#include "shell/curved/vertex_curvature.hpp"

namespace sphshell {

// The second derivatives of the cubic elements are off by the square of their size. The curvature
// is fitted at the vertices instead, and carried into the elements by cubics that match its first
// derivatives as well: it is continuous over smooth sides. It is zero in flat elements and on their
// smooth borders. The fits also tell how far the surface lies beyond the elements.
//
// What was fitted is kept: one per shell and thread. Elements that were asked for before take no
// heap.
class CurvatureField {
 public:
  // A symmetric tensor: xx, yy, zz, xy, xz, yz.
  using Tensor = Eigen::Matrix<double, 6, 1>;
  // The curvature [1/m], positive where the surface bends away from the element's normal, and how
  // far it lies beyond the element along that normal [m].
  using Local = Eigen::Matrix<double, 7, 1>;
  // A point of a facet, with its parameters.
  struct Place {
    int facet;
    Eigen::Vector2d at;
    Vec3 point;
  };

  explicit CurvatureField(const Shell& shell) : shell_(&shell) {}
  const Shell& shell() const { return *shell_; }

  // Of the facet alone: of a face of known shape, from that shape, else from the fits.
  Local own(const Place& place);
  // Next to a joint, where faces of known shape go on smoothly into others, the mean of what they
  // have there, over a length whose square is `length2`: see blending.cpp. The place is within the
  // `reach` [m] of the point that was last given to look_about().
  Local at(const Place& place, double length2);
  void look_about(const Vec3& point, double reach);
  // Whether there is such a joint about a facet.
  bool near_joint(int facet) { return !joints_about(facet).empty(); }

  // Between a symmetric matrix and its six numbers.
  static Mat3 matrix(const Tensor& t);
  static Tensor tensor(const Mat3& m);

 private:
  // How far the surface lies beyond an element: zero at the corners, and as the fits at both ends
  // say at four points of each side, and in the middle.
  class Rise {
   public:
    double middle = 0;  // beyond what the sides give there

    void set_side(int k, const double (&at)[4]);
    double at(double u, double v) const;

   private:
    double even_[3][2] = {}, odd_[3][2] = {};
  };
  struct Cell {
    Cubic2<Tensor> tensor;
    Rise rise;
  };
  // Of the elements of one surface that are joined smoothly at a vertex.
  struct Fan {
    VertexCurvature fit;
    Tensor tensor;  // that holds at the vertex, where others are joined to them
  };

  // What was fitted for a facet, or for the fan of a corner; made where it is asked for first.
  const Cell& cell(int facet);
  const Fan& fan(int facet, int corner);
  // The fit to the vertices around a corner's fan.
  VertexCurvature fit_at(int corner);
  void collect_fan(int corner, bool all, std::vector<int>& corners) const;
  // Half-edges 3 facet + side, of which one owns what both elements share.
  int owner_of_side(int facet, int side);
  std::pair<Tensor, Tensor> along_side(int facet, int side);
  // How far the fits say that the surface lies beyond the element [m].
  double beyond(int facet, double u, double v);
  Rise rise_of(int facet);
  // The face of known shape that a facet lies on; -1: the fits hold.
  int region_of(int facet) const;
  const std::vector<int>& joints_about(int facet);
  Local on_half_edge(int half_edge, const Vec3& point);

  const Shell* shell_;
  std::unordered_map<int, int> fan_of_, cell_of_;  // of corners (3 facet + k), of facets
  std::vector<Fan> fans_;
  std::vector<Cell> cells_;
  std::vector<int> corners_, beside_;
  std::vector<OrientedPoint> around_;
  Vec3 about_ = Vec3::Zero();
  double reach_ = 0;
  // Half-edges at joints about a facet, of each side one; found where they are asked for.
  struct Joints {
    int facet;
    std::vector<int> half_edges;
  };
  std::vector<Joints> joints_;
  std::size_t looked_ = 0;  // so many of them are about the point
  struct Neighbor {
    int region;
    double least2, weights;
    Local sum;
  };
  std::vector<Neighbor> neighbors_;
  std::vector<std::uint32_t> visited_;  // per facet the last walk that came there
  std::uint32_t walk_ = 0;
};

}  // namespace sphshell
