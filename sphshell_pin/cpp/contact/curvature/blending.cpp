// Curvature next to joints.
//
// Where a flat goes on smoothly into a fillet the curvature of the surface jumps. Hertz's energy
// must not, and the ellipse of contact straddles both faces. With a the radius of contact, r_j the
// faces about a point x of the surface, d_j the distance from x to r_j (zero to its own face), and
// K_j the curvature at the point of r_j next to x, the curvature is the mean
//
//   K(x) = sum_j w_j K_j / sum_j w_j,  w_j = (1 - d_j^2 / a^2)^2 where d_j < a, else 0
//
// It is a function of x alone, whichever facet holds x: on a border both faces have d = 0. As w is
// flat at d = 0, the first derivatives agree there too, wherever K_j goes on smoothly.
#include <algorithm>
#include <tuple>

#include "contact/curvature/curvature_field.hpp"
#include "contact/curvature/element_corners.hpp"
#include "contact/faces/face_feet.hpp"
#include "contact/query/closest_on_cell.hpp"
#include "contact/query/closest_on_side.hpp"

namespace sphshell {
namespace {

double square(double x) { return x * x; }

}  // namespace

int CurvatureField::region_of(int facet) const {
  const LargeArray<FaceCell>& cells = shell_->curved()->face_cells();
  return cells.empty() || !cells[facet].closed ? -1 : cells[facet].face;
}

void CurvatureField::look_about(const Vec3& point, double reach) {
  about_ = point, reach_ = reach, looked_ = 0;
}

// Breadth first over smooth sides within reach, so that the other side of a thin plate does not
// count.
const std::vector<int>& CurvatureField::joints_about(int facet) {
  for (std::size_t i = 0; i < looked_; ++i)
    if (joints_[i].facet == facet) return joints_[i].half_edges;
  if (joints_.size() == looked_) joints_.emplace_back();
  Joints& found = joints_[looked_++];
  found.facet = facet;
  found.half_edges.clear();
  const LargeArray<FaceCell>& cells = shell_->curved()->face_cells();
  if (cells.empty()) return found.half_edges;
  if (visited_.empty() || ++walk_ == 0) visited_.assign(shell_->facets().size(), 0), walk_ = 1;
  const auto add = [&](int f) {
    if (visited_[f] != walk_) corners_.push_back(f);
    visited_[f] = walk_;
  };
  corners_.clear();
  add(facet);
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    const int f = corners_[i];
    const Facet& flat = shell_->facets()[f];
    for (int k = 0; k < 3; ++k) {
      const Vec3 &p = flat.corner[k], d = flat.corner[next_corner(k)] - p;
      const double t = std::clamp((about_ - p).dot(d) / d.squaredNorm(), 0.0, 1.0);
      const double reach = reach_ + shell_->curved()->facets()[f].bulge + cells[f].bulge[k];
      if ((p + t * d - about_).squaredNorm() > reach * reach) continue;
      const int other = smooth_over(*shell_, f, k);
      if (other < 0) continue;
      add(triangle_of(other));
      if (region_of(f) != region_of(triangle_of(other)) && 3 * f + k < other)
        found.half_edges.push_back(3 * f + k);
    }
  }
  return found.half_edges;
}

// What the facet of a half-edge has next to a point.
CurvatureField::Local CurvatureField::on_half_edge(int h, const Vec3& point) {
  const int f = triangle_of(h), k = side_of(h);
  Place place{f, {0, 0}, point};
  if (region_of(f) < 0) {
    const CubicCurve side = shell_->curved()->facets()[f].side(shell_->facets()[f], k);
    std::tie(place.at[0], place.at[1]) = on_side(k, nearest_on_side(side, point));
  }
  return own(place);
}

// Along its border a region takes part with all its sides, by Shepard's weights, so that nothing
// jumps where another one becomes the nearest.
CurvatureField::Local CurvatureField::at(const Place& place, double length2) {
  const std::vector<int>& joints = joints_about(place.facet);
  Local sum = own(place);
  if (joints.empty()) return sum;
  neighbors_.clear();
  for (int joint : joints) {
    const int beside = smooth_over(*shell_, triangle_of(joint), side_of(joint));
    // The face of known shape gives the border.
    const int h = region_of(triangle_of(joint)) < 0 ? beside : joint;
    const SideFoot foot =
        nearest_on_side(*shell_, triangle_of(h), side_of(h), Sphere{place.point, 0, 0});
    const double d2 = (foot.point - place.point).squaredNorm();
    if (!(d2 < length2)) continue;
    const double weight = square(1 - d2 / length2) / std::max(d2, 1e-24 * length2);
    for (int side : {joint, beside}) {
      const int region = region_of(triangle_of(side));
      if (region == region_of(place.facet)) continue;
      auto at = std::find_if(neighbors_.begin(), neighbors_.end(),
                             [&](const Neighbor& one) { return one.region == region; });
      if (at == neighbors_.end())
        at = neighbors_.insert(at, Neighbor{region, d2, 0, Local::Zero()});
      at->least2 = std::min(at->least2, d2);
      at->weights += weight;
      at->sum += weight * on_half_edge(side, foot.point);
    }
  }
  double weights = 1;
  for (const Neighbor& one : neighbors_) {
    const double weight = square(1 - one.least2 / length2);
    sum += weight / one.weights * one.sum;
    weights += weight;
  }
  return sum / weights;
}

}  // namespace sphshell
