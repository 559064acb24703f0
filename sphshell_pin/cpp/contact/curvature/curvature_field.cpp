#include "contact/curvature/curvature_field.hpp"

#include <tuple>

#include "contact/query/closest_on_cell.hpp"
#include "contact/curvature/element_corners.hpp"

namespace sphshell {
namespace {

// Elements whose normals turn this much more than their neighbors' belong to another surface, such
// as a fillet.
constexpr double kJump = 1.5;
// What elements leave of a surface that they resolve is a small share of their own bulge: more is
// noise.
constexpr double kLargestRise = 0.1;
// Whether two half-edges of one edge begin at its other ends.
bool is_reversed(const Shell& shell, int half_edge, int other) {
  return vertex_of(shell, half_edge) != vertex_of(shell, other);
}

// How fast the normals of an element turn, the most along a side [1/m]: the chord of the normals
// over that of the corners.
double bend_of(const Shell& shell, int facet) {
  if (shell.curved()->facets()[facet].flat) return 0;
  const Facet& flat = shell.facets()[facet];
  const Vec3 normal[3] = {normal_at(shell, 3 * facet), normal_at(shell, 3 * facet + 1),
                          normal_at(shell, 3 * facet + 2)};
  double most = 0;
  for (int k = 0; k < 3; ++k) {
    const int n = next_corner(k);
    most =
        std::max(most, (normal[n] - normal[k]).norm() / (flat.corner[n] - flat.corner[k]).norm());
  }
  return most;
}

// Whether two neighbors are of surfaces with other curvatures.
bool is_jump(const Shell& shell, int facet, int other) {
  const double a = bend_of(shell, facet), b = bend_of(shell, other);
  return std::max(a, b) > kJump * std::min(a, b);
}

}  // namespace

Mat3 CurvatureField::matrix(const Tensor& t) {
  Mat3 out;
  out << t[0], t[3], t[4], t[3], t[1], t[5], t[4], t[5], t[2];
  return out;
}

// Each side's polynomial is blended into the element, and the middle is lifted by what is missing
// there.
double CurvatureField::Rise::at(double u, double v) const {
  const double b[3] = {1 - u - v, u, v};
  double out = 27 * middle * b[0] * b[1] * b[2];
  for (int k = 0; k < 3; ++k) {
    const int n = next_corner(k);
    const double both = b[k] * b[n];
    out += both *
           (even_[k][0] + both * even_[k][1] + (b[n] - b[k]) * (odd_[k][0] + both * odd_[k][1]));
  }
  return out;
}

// The product of both coordinates is 0.16 at the outer two of the points, 0.24 at the others.
void CurvatureField::Rise::set_side(int k, const double (&at)[4]) {
  const double outer = 0.5 * (at[0] + at[3]) / 0.16, inner = 0.5 * (at[1] + at[2]) / 0.24;
  even_[k][1] = (inner - outer) / 0.08, even_[k][0] = outer - 0.16 * even_[k][1];
  const double apart = 0.5 * (at[3] - at[0]) / (0.16 * 0.6);
  const double near = 0.5 * (at[2] - at[1]) / (0.24 * 0.2);
  odd_[k][1] = (near - apart) / 0.08, odd_[k][0] = apart - 0.16 * odd_[k][1];
}

// From the shape of the face; from the cubic of the cell; or zero where the element is flat.
CurvatureField::Local CurvatureField::own(const Place& place) {
  Local out = Local::Zero();
  if (const Primitive* face = shell_->curved()->face_of(place.facet)) {
    // The Hessian of a face's distance on the face is its curvature tensor.
    const int sign = shell_->curved()->face_cells()[place.facet].sign;
    out.head<6>() = sign * tensor(face->hessian(face->onto(place.point)));
  } else if (!shell_->curved()->facets()[place.facet].flat) {
    const Cell& here = cell(place.facet);
    out << here.tensor.point(place.at[0], place.at[1]), here.rise.at(place.at[0], place.at[1]);
  }
  return out;
}

CurvatureField::Tensor CurvatureField::tensor(const Mat3& m) {
  Tensor out;
  out << m(0, 0), m(1, 1), m(2, 2), m(0, 1), m(0, 2), m(1, 2);
  return out;
}

// The tensors at a third and two thirds of a side, by the fits' tensors at its ends and their
// derivatives along it: a cubic in Bezier form has b1 = b0 + b0' / 3.
std::pair<CurvatureField::Tensor, CurvatureField::Tensor> CurvatureField::along_side(int facet,
                                                                                     int side) {
  const CurvedFacet& curved = shell_->curved()->facets()[facet];
  if (curved.flat) return {Tensor::Zero(), Tensor::Zero()};
  const CubicCurve curve = curved.side(shell_->facets()[facet], side);
  // Copies: the second one may move the first.
  const VertexCurvature from = fan(facet, side).fit;
  const VertexCurvature to = fan(facet, next_corner(side)).fit;
  return {tensor(from.tensor() + from.change(curve.tangent(0)) / 3),
          tensor(to.tensor() - to.change(curve.tangent(1)) / 3)};
}

// Where two surfaces of other curvatures meet smoothly, the flatter one's holds on their border: it
// has the larger elements. The half-edge, given in facets, whose element says what holds.
int CurvatureField::owner_of_side(int facet, int side) {
  const int other = smooth_over(*shell_, facet, side);
  if (other < 0 || !is_jump(*shell_, facet, triangle_of(other))) return 3 * facet + side;
  const auto here = along_side(facet, side);
  const auto there = along_side(triangle_of(other), side_of(other));
  return there.first.squaredNorm() + there.second.squaredNorm() <
                 here.first.squaredNorm() + here.second.squaredNorm()
             ? other
             : 3 * facet + side;
}

const CurvatureField::Cell& CurvatureField::cell(int facet) {
  const auto found = cell_of_.find(facet);
  if (found != cell_of_.end()) return cells_[found->second];
  // Bezier ordinates: at the corners, at a third and two thirds of each side, in the middle.
  Tensor corner[3], first[3], last[3];
  Tensor middle = Tensor::Zero();
  for (int k = 0; k < 3; ++k) {
    const Fan& here = fan(facet, k);
    corner[k] = here.tensor;
    // The usual choice of the middle ordinate, b111 = (sum of the side ordinates) / 4 - (sum of the
    // corners) / 6, with which a quadratic is reproduced.
    middle -= tensor(here.fit.tensor()) / 6;
    std::tie(first[k], last[k]) = along_side(facet, k);
    middle += (first[k] + last[k]) / 4;
    const int owner = owner_of_side(facet, k);
    if (owner != 3 * facet + k) {
      std::tie(first[k], last[k]) = along_side(triangle_of(owner), side_of(owner));
      if (is_reversed(*shell_, 3 * facet + k, owner)) std::swap(first[k], last[k]);
    }
  }
  Cell made;
  Cubic2<Tensor>& out = made.tensor;
  const Tensor &b0 = corner[0], &u1 = first[0], &u2 = last[0], &v1 = last[2], &v2 = first[2];
  out.c00 = b0;
  out.c10 = 3 * (u1 - b0);
  out.c01 = 3 * (v1 - b0);
  out.c20 = 3 * (b0 - 2 * u1 + u2);
  out.c02 = 3 * (b0 - 2 * v1 + v2);
  out.c11 = 6 * (b0 - u1 - v1 + middle);
  out.c30 = corner[1] - b0 + 3 * (u1 - u2);
  out.c03 = corner[2] - b0 + 3 * (v1 - v2);
  out.c21 = 3 * (2 * u1 - b0 - u2 + v1 - 2 * middle + first[1]);
  out.c12 = 3 * (2 * v1 - b0 - v2 + u1 - 2 * middle + last[1]);
  // The sums above convert Bezier ordinates to coefficients of u^i v^j.
  made.rise = rise_of(facet);
  cell_of_.emplace(facet, static_cast<int>(cells_.size()));
  cells_.push_back(made);
  return cells_.back();
}

// How far beyond a point of an element the surface lies, along the normal there: the mean of what
// the fits at the corners say, each weighted by the square of its coordinate.
double CurvatureField::beyond(int facet, double u, double v) {
  const CurvedFacet& curved = shell_->curved()->facets()[facet];
  if (curved.flat) return 0;
  const CubicPatch patch = curved.patch(shell_->facets()[facet]);
  const double b[3] = {1 - u - v, u, v};
  const Vec3 point = patch.point(u, v), normal = normal_of(patch, u, v);
  double sum = 0, weights = 0;
  for (int k = 0; k < 3; ++k) {
    if (b[k] < 1e-9) continue;
    sum += b[k] * b[k] * fan(facet, k).fit.beyond(point, normal);
    weights += b[k] * b[k];
  }
  return sum / weights;
}

// At four points of each side, by the side's owner, so that both elements agree; limited to a share
// of the bulge.
CurvatureField::Rise CurvatureField::rise_of(int facet) {
  const LargeArray<CurvedFacet>& cells = shell_->curved()->facets();
  const double bulge = cells[facet].bulge;
  Rise out;
  for (int k = 0; k < 3; ++k) {
    const int owner = owner_of_side(facet, k);
    const bool reversed = is_reversed(*shell_, 3 * facet + k, owner);
    const int other = smooth_over(*shell_, facet, k);
    const double most =
        kLargestRise * std::min(bulge, other < 0 ? bulge : cells[triangle_of(other)].bulge);
    double at[4];
    for (int i = 0; i < 4; ++i) {
      const auto [u, v] = on_side(side_of(owner), 0.2 * (1 + (reversed ? 3 - i : i)));
      at[i] = std::clamp(beyond(triangle_of(owner), u, v), -most, most);
    }
    out.set_side(k, at);
  }
  const double middle = beyond(facet, 1.0 / 3, 1.0 / 3);
  out.middle =
      std::clamp(middle, -kLargestRise * bulge, kLargestRise * bulge) - out.at(1.0 / 3, 1.0 / 3);
  return out;
}

// The corners of elements that are joined smoothly at a vertex, in ascending order; `all`: those of
// other curvatures as well.
void CurvatureField::collect_fan(int corner, bool all, std::vector<int>& corners) const {
  connected_corners(*shell_, corner, corners, [&](int c, int other, const Edge& edge) {
    return edge.count == 2 && is_smooth(normal_at(*shell_, c), normal_at(*shell_, other)) &&
           (all || !is_jump(*shell_, c / 3, other / 3));
  });
  std::sort(corners.begin(), corners.end());
}

const CurvatureField::Fan& CurvatureField::fan(int facet, int corner) {
  const auto found = fan_of_.find(3 * facet + corner);
  if (found != fan_of_.end()) return fans_[found->second];
  // All parts of the fan, each of one surface; the flattest one's curvature holds at the vertex.
  std::vector<int> all;
  collect_fan(3 * facet + corner, true, all);
  const std::size_t first = fans_.size();
  Tensor flattest = Tensor::Constant(std::numeric_limits<double>::infinity());
  for (int c : all) {
    // Part of a fan that was fitted with another of its corners.
    if (fan_of_.count(c)) continue;
    const VertexCurvature fit = fit_at(c);
    for (int one : corners_) fan_of_.emplace(one, static_cast<int>(fans_.size()));
    fans_.push_back({fit, Tensor::Zero()});
    const Tensor bend = tensor(fit.tensor());
    if (bend.squaredNorm() < flattest.squaredNorm()) flattest = bend;
  }
  for (std::size_t i = first; i < fans_.size(); ++i) fans_[i].tensor = flattest;
  return fans_[fan_of_.at(3 * facet + corner)];
}

// Leaves the corners of its part of the fan in corners_.
VertexCurvature CurvatureField::fit_at(int corner) {
  collect_fan(corner, false, corners_);
  const int first = corners_[0];
  const bool exact = shell_->curved()->exact();
  // The neighbors of the vertex; of flat elements nothing is fitted, their curvature is zero.
  around_.clear();
  const auto add_around = [&](const std::vector<int>& corners) {
    for (int c : corners)
      for (int k : {next_corner(c % 3), previous_corner(c % 3)})
        around_.push_back({shell_->facets()[c / 3].corner[k], normal_at(*shell_, c / 3 * 3 + k)});
  };
  if (!shell_->curved()->facets()[corner / 3].flat) add_around(corners_);
  if (!exact && !around_.empty()) {
    // Positions alone take more of them: the neighbors of neighbors, each once.
    for (int c : corners_)
      for (int k : {next_corner(c % 3), previous_corner(c % 3)}) {
        collect_fan(c / 3 * 3 + k, false, beside_);
        add_around(beside_);
      }
    // Sorted by coordinates, so that points that are met twice are neighbors, and the sums of the
    // fit do not depend on the numbering.
    const auto before = [](const OrientedPoint& a, const OrientedPoint& b) {
      return std::lexicographical_compare(a.point.data(), a.point.data() + 3, b.point.data(),
                                          b.point.data() + 3);
    };
    const auto same = [](const OrientedPoint& a, const OrientedPoint& b) {
      return a.point == b.point;
    };
    std::sort(around_.begin(), around_.end(), before);
    around_.erase(std::unique(around_.begin(), around_.end(), same), around_.end());
  }
  return fit_curvature(shell_->facets()[first / 3].corner[first % 3], normal_at(*shell_, first),
                       around_, exact);
}

}  // namespace sphshell
