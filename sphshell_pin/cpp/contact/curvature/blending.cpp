// Curvature next to joints.
//
// Where a flat goes on smoothly into a fillet the curvature of the surface jumps. Hertz's energy
// must not, and the ellipse of contact straddles both faces. With a the radius of contact, r_j the
// faces about a point x of the surface, d_j the distance from x to r_j (zero to its own face), and
// K_j the curvature at the point of r_j next to x, the curvature is the mean
//
//   K(x) = sum_j w_j K_j / sum_j w_j,  w_j = h / (1 - h)
//   h = 1/2 - d_j^2 / a^2 up to d_j = a / 2, then (1 - d_j / a)^2, and none from a on
//
// It is a function of x alone, whichever facet holds x: on a border both faces have d = 0. As w is
// flat at d = 0, the first derivatives agree there too, wherever K_j goes on smoothly. Next to one
// joint h is the share of the other face: of all that go from 1/2 to 0 and are flat at both ends it
// has the smallest second derivative, by which the force changes.
#include <tuple>

#include "contact/curvature/curvature_field.hpp"
#include "contact/curvature/element_corners.hpp"
#include "contact/faces/face_feet.hpp"
#include "contact/query/closest_on_cell.hpp"
#include "contact/query/closest_on_side.hpp"

namespace sphshell {
namespace {

double square(double x) { return x * x; }

// w by the square of d / a.
double weight_of(double t2) {
  const double h = t2 < 0.25 ? 0.5 - t2 : square(1 - std::sqrt(std::min(t2, 1.0)));
  return h / (1 - h);
}

double chord_distance2(const Facet& facet, int side, const Vec3& x) {
  const Vec3 &p = facet.corner[side], d = facet.side(side);
  const double t = std::clamp((x - p).dot(d) / d.squaredNorm(), 0.0, 1.0);
  return (p + t * d - x).squaredNorm();
}

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
  // Each of them is of one walk, the last one of the latest: what it came to has the same joints.
  for (std::size_t i = 0; i < looked_; ++i)
    if (joints_[i].facet == facet ||
        (!visited_.empty() && visited_[facet] == walk_ - std::uint32_t(looked_ - 1 - i)))
      return joints_[i].half_edges;
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
    for (int k = 0; k < 3; ++k) {
      const double reach = reach_ + shell_->curved()->facets()[f].bulge + cells[f].bulge[k];
      if (chord_distance2(shell_->facets()[f], k, about_) > reach * reach) continue;
      const int h = shell_->topology().other_half_edge(shell_->half_edge(3 * f + k));
      if (h < 0) continue;
      const int other = shell_->facet_half_edge(h), g = triangle_of(other);
      const bool within = region_of(f) == region_of(g);
      // Within a face the normals need not be compared.
      if (within && (region_of(f) >= 0 || visited_[g] == walk_ ||
                     shell_->facets()[f].planar_face == shell_->facets()[g].planar_face)) {
        add(g);
      } else if ((within || 3 * f + k < other || visited_[g] != walk_) &&
                 smooth_over(*shell_, f, k) >= 0) {
        add(g);
        if (!within && 3 * f + k < other)
          found.half_edges.insert(found.half_edges.end(), {3 * f + k, other});
      }
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
  // Towards the tip of a cone the curvature grows without limit. Where it exceeds 1 / (2 a) it goes
  // on linearly with the distance, to 1 / a at the tip: see at_tip() in curvature.cpp.
  const Primitive* face = shell_->curved()->face_of(place.facet);
  if (const double bend = std::abs(sum.head<3>().sum()) * std::sqrt(length2);
      face && face->kind == FaceKind::Cone && bend > 0.5)
    sum.head<6>() *= (1 - 0.25 / bend) / bend;
  if (joints.empty()) return sum;
  neighbors_.clear();
  for (std::size_t i = 0; i < joints.size(); i += 2) {
    const int joint = joints[i], beside = joints[i + 1];
    // The face of known shape gives the border.
    const int h = region_of(triangle_of(joint)) < 0 ? beside : joint;
    const int f = triangle_of(h), k = side_of(h);
    const double bulge = std::max(double(shell_->curved()->facets()[f].bulge),
                                  double(shell_->curved()->face_cells()[f].bulge[k]));
    if (chord_distance2(shell_->facets()[f], k, place.point) > square(std::sqrt(length2) + bulge))
      continue;
    const SideFoot foot = nearest_on_side(*shell_, f, k, Sphere{place.point, 0, 0});
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
    const double weight = weight_of(one.least2 / length2);
    sum += weight / one.weights * one.sum;
    weights += weight;
  }
  return sum / weights;
}

}  // namespace sphshell
