#include "contact/curvature.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "contact/closest_on_cell.hpp"
#include "contact/query.hpp"

namespace sphshell {
namespace {

// Normals that differ less are one [1 - cos]: those of a smooth vertex agree to round-off.
constexpr double kSameNormal = 1e-10;
// Elements whose normals turn this much more than their neighbors' belong to another surface, such
// as a fillet.
constexpr double kJump = 1.5;
// What elements leave of a surface that they resolve is a small share of their own bulge: more is
// noise.
constexpr double kLargestRise = 0.1;
// Of the radius: a step of the center for second derivatives, and a distance without direction.
constexpr double kStep = 1e-5, kNoDistance = 1e-6;

Vec3 normal_of(const CubicPatch& patch, double u, double v) {
  return patch.along_u(u, v).cross(patch.along_v(u, v)).normalized();
}

std::pair<double, double> corner_parameters(int k) {
  return {k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0};
}

bool is_same(const Vec3& a, const Vec3& b) { return a.dot(b) > 1 - kSameNormal; }

double angle_between(const Vec3& a, const Vec3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

// The facet and corner of a vertex at a half-edge that begins or ends there, given in facets.
int corner_of(const Shell& shell, int half_edge, int vertex) {
  const int facet = triangle_of(half_edge);
  const Triangle& triangle = shell.triangles()[shell.triangle_of_facet(facet)];
  for (int k = 0; k < 3; ++k)
    if (triangle[k] == vertex) return 3 * facet + k;
  return -1;
}

// Whether two half-edges of one edge, given in facets, begin at its other ends.
bool is_reversed(const Shell& shell, int half_edge, int other) {
  return shell.triangles()[shell.triangle_of_facet(triangle_of(half_edge))][side_of(half_edge)] !=
         shell.triangles()[shell.triangle_of_facet(triangle_of(other))][side_of(other)];
}

const Edge& edge_at(const Shell& shell, int facet, int side) {
  const Topology& topology = shell.topology();
  return topology.edges[topology.edge_of[3 * shell.triangle_of_facet(facet) + side]];
}

int vertex_of(const Shell& shell, int corner) {
  return shell.triangles()[shell.triangle_of_facet(corner / 3)][corner % 3];
}

Vec3 normal_at(const Shell& shell, int corner) {
  const auto [u, v] = corner_parameters(corner % 3);
  const int facet = corner / 3;
  return normal_of(shell.curved()->facets()[facet].patch(shell.facets()[facet]), u, v);
}

// How fast the normals of an element turn: the most along a side [1/m].
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

// The half-edge, given in facets, of the neighbor that an element is joined to smoothly over a
// side; -1: there is none.
int joined_over(const Shell& shell, int facet, int side) {
  const Edge& edge = edge_at(shell, facet, side);
  if (edge.count != 2) return -1;
  const int h = 3 * shell.triangle_of_facet(facet) + side;
  const int other = shell.facet_half_edge(shell.topology().other_half_edge(edge, h));
  for (int k : {side, next_corner(side)}) {
    const int corner = 3 * facet + k;
    const int beside = corner_of(shell, other, vertex_of(shell, corner));
    if (!is_same(normal_at(shell, corner), normal_at(shell, beside))) return -1;
  }
  return other;
}

// The point of an element nearest to one that is on it but for round-off.
std::pair<double, double> parameters_of(const CubicPatch& patch, const Facet& facet,
                                        const Vec3& point) {
  auto [u, v] = closest_on_facet(facet, point);
  for (int i = 0; i < 8; ++i) {
    const Vec3 from = point - patch.point(u, v);
    const Vec3 xu = patch.along_u(u, v), xv = patch.along_v(u, v);
    const double a = xu.dot(xu), b = xu.dot(xv), c = xv.dot(xv), det = a * c - b * b;
    const double gu = xu.dot(from), gv = xv.dot(from);
    const double du = (c * gu - b * gv) / det, dv = (a * gv - b * gu) / det;
    u += du, v += dv;
    if (std::abs(du) + std::abs(dv) < 1e-13) break;
  }
  return {u, v};
}

}  // namespace

Mat3 Curvature::matrix(const Tensor& t) {
  Mat3 out;
  out << t[0], t[3], t[4], t[3], t[1], t[5], t[4], t[5], t[2];
  return out;
}

Eigen::Vector3d Curvature::Rise::at(double u, double v) const {
  const double b[3] = {1 - u - v, u, v};
  static constexpr double kBy[3][2] = {{-1, -1}, {1, 0}, {0, 1}};
  Eigen::Vector3d out(27 * middle * b[0] * b[1] * b[2], 0, 0);
  for (int d = 0; d < 2; ++d)
    out[1 + d] =
        27 * middle * (kBy[0][d] * b[1] * b[2] + b[0] * kBy[1][d] * b[2] + b[0] * b[1] * kBy[2][d]);
  for (int k = 0; k < 3; ++k) {
    const int n = next_corner(k);
    const double both = b[k] * b[n], along = b[n] - b[k];
    const double even = even_[k][0] + both * even_[k][1], odd = odd_[k][0] + both * odd_[k][1];
    out[0] += both * (even + along * odd);
    for (int d = 0; d < 2; ++d) {
      const double both_by = kBy[k][d] * b[n] + b[k] * kBy[n][d];
      out[1 + d] +=
          both_by * (even + along * odd) +
          both * (both_by * (even_[k][1] + along * odd_[k][1]) + (kBy[n][d] - kBy[k][d]) * odd);
    }
  }
  return out;
}

// The product of both coordinates is 0.16 at the outer two of the points, 0.24 at the others.
void Curvature::Rise::set_side(int k, const double (&at)[4]) {
  const double outer = 0.5 * (at[0] + at[3]) / 0.16, inner = 0.5 * (at[1] + at[2]) / 0.24;
  even_[k][1] = (inner - outer) / 0.08, even_[k][0] = outer - 0.16 * even_[k][1];
  const double apart = 0.5 * (at[3] - at[0]) / (0.16 * 0.6);
  const double near = 0.5 * (at[2] - at[1]) / (0.24 * 0.2);
  odd_[k][1] = (near - apart) / 0.08, odd_[k][0] = apart - 0.16 * odd_[k][1];
}

Curvature::Local Curvature::Field::at(double u, double v) const {
  Local out;
  out << tensor.point(u, v), rise.at(u, v)[0];
  return out;
}

Curvature::Tensor Curvature::tensor(const Mat3& m) {
  Tensor out;
  out << m(0, 0), m(1, 1), m(2, 2), m(0, 1), m(0, 2), m(1, 2);
  return out;
}

ContactShape Curvature::shape(const Shell& shell, const Contact& contact, const Vec3& center,
                              double radius, bool want_second) {
  const CurvedFacet& curved = shell.curved()->facets()[contact.facet];
  // Of a flat element nothing depends on the place.
  if (contact.feature == Feature::Face && curved.flat) {
    ContactShape out = shape_of_gap(Mat3::Identity() / radius, contact.normal, radius);
    out.depth = contact.depth;
    return out;
  }
  const Facet& facet = shell.facets()[contact.facet];
  Place place{contact.facet, contact.feature, contact.index, 0, 0, curved.patch(facet)};
  std::tie(place.u, place.v) = parameters_of(place.patch, facet, contact.point);
  Motion motion;
  ContactShape out = shape_at(shell, place, contact.depth, center, contact.normal, radius, motion);
  if (!want_second || motion.normal.isZero(0)) return out;
  const double step = kStep * radius;
  for (int i = 0; i < 3; ++i) {
    out.second.col(i).setZero(), out.tilt_by.col(i).setZero();
    for (int sign : {1, -1}) {
      const Vec3 moved = sign * step * Vec3::Unit(i);
      Place there = place;
      there.u += motion.parameters.row(0).dot(moved);
      there.v += motion.parameters.row(1).dot(moved);
      Vec3 normal = (center + moved - place.patch.point(there.u, there.v)).normalized();
      if (normal.dot(contact.normal) < 0) normal = -normal;
      Motion unused;
      const ContactShape other = shape_at(shell, there, contact.depth - contact.normal.dot(moved),
                                          center + moved, normal, radius, unused);
      out.second.col(i) += sign / (2 * step) * other.gradient;
      out.tilt_by.col(i) += sign / (2 * step) * other.tilt;
    }
  }
  out.second = (0.5 * (out.second + out.second.transpose())).eval();
  return out;
}

ContactShape Curvature::shape_at(const Shell& shell, const Place& place, double depth,
                                 const Vec3& center, const Vec3& normal, double radius,
                                 Motion& motion) {
  const CubicPatch& patch = place.patch;
  const double u = place.u, v = place.v;
  const Vec3 from = center - patch.point(u, v);
  const double distance = from.dot(normal);  // negative of a sphere that is pushed back out
  motion.parameters.setZero(), motion.normal.setZero();
  const bool moves = std::abs(distance) > kNoDistance * radius;
  if (moves) {
    Mat3 dx_dc = Mat3::Zero();
    if (place.feature == Feature::Face) {
      dx_dc = dx_dc_of(patch, u, v, center);
    } else if (place.feature == Feature::Edge) {
      const Facet& facet = shell.facets()[place.facet];
      const double t = place.index == 0 ? u : place.index == 1 ? v : 1 - v;
      dx_dc = dx_dc_of(shell.curved()->facets()[place.facet].side(facet, place.index), t, center);
    }
    Eigen::Matrix<double, 3, 2> along;
    along << patch.along_u(u, v), patch.along_v(u, v);
    motion.parameters = (along.transpose() * along).inverse() * along.transpose() * dx_dc;
    motion.normal = (Mat3::Identity() - normal * normal.transpose() - dx_dc) / distance;
  }
  Local local;
  Eigen::Matrix<double, 7, 3> local_by;
  if (place.feature == Feature::Face) {
    const Field& f = field(shell, place.facet);
    const double sign = normal_of(patch, u, v).dot(normal) < 0 ? -1 : 1;
    const Eigen::Vector3d rise = f.rise.at(u, v);
    Eigen::Matrix<double, 7, 2> by;
    by << f.tensor.along_u(u, v), f.tensor.along_v(u, v), rise[1], rise[2];
    local << f.tensor.point(u, v), rise[0];
    local *= sign;
    local_by = sign * by * motion.parameters;
  } else {
    local = between_walls(shell, place, normal);
    local_by.setZero();
    const double step = kStep * radius;
    for (int i = 0; i < 3 && moves; ++i)
      for (int sign : {1, -1}) {
        Place there = place;
        there.u += sign * step * motion.parameters(0, i);
        there.v += sign * step * motion.parameters(1, i);
        const Vec3 turned = (normal + sign * step * motion.normal.col(i)).normalized();
        local_by.col(i) += sign / (2 * step) * between_walls(shell, there, turned);
      }
  }
  const Mat3 curvature = matrix(local.head<6>());
  Mat3 slope;
  ContactShape out = shape_of_gap(curvature + Mat3::Identity() / radius, normal, radius, &slope);
  // The slope lies in the tangent plane, which turns with the normal.
  const Vec3 turn = 2 * slope * (curvature * normal);
  for (int i = 0; i < 3; ++i)
    out.gradient[i] = (slope.array() * matrix(local_by.col(i).head<6>()).array()).sum() -
                      turn.dot(motion.normal.col(i));
  // The rise comes on with the depth, so that a touch begins where it is found.
  const double rise = local[6];
  const double share = rise == 0 ? 0 : std::exp(-depth / std::abs(rise));
  out.depth = depth + rise * (1 - share);
  out.tilt =
      (rise < 0 ? -share : share) * normal -
      (1 - share * (1 + (rise == 0 ? 0 : depth / std::abs(rise)))) * local_by.row(6).transpose();
  return out;
}

// Shepard's interpolation between the arcs from wall to wall, each weighted by the inverse square
// of what the way over the normal is longer than the arc; along an arc by the angle.
Curvature::Local Curvature::between_walls(const Shell& shell, const Place& place,
                                          const Vec3& normal) {
  walls_.clear();
  if (place.feature == Feature::Edge)
    find_walls_of_side(shell, place.facet, place.index,
                       place.index == 0   ? place.u
                       : place.index == 1 ? place.v
                                          : 1 - place.v);
  else
    find_walls_of_vertex(shell, place.facet, place.index);
  Vec3 outward = Vec3::Zero();
  for (const auto& [a, b] : walls_) outward += a.normal + b.normal;
  const double sign = outward.dot(normal) < 0 ? -1 : 1;
  Local sum = Local::Zero();
  double weights = 0;
  for (const auto& [a, b] : walls_) {
    const double from_a = angle_between(sign * normal, a.normal);
    const double from_b = angle_between(sign * normal, b.normal);
    const double apart = from_a + from_b;
    const double detour = std::max(apart - angle_between(a.normal, b.normal), 1e-12);
    const double share = apart > 0 ? from_a / apart : 0.5;
    const double weight = 1 / (detour * detour);
    sum += weight * ((1 - share) * a.local + share * b.local);
    weights += weight;
  }
  return sign / weights * sum;
}

Curvature::Wall Curvature::wall(const Shell& shell, int facet, double u, double v) {
  const CurvedFacet& curved = shell.curved()->facets()[facet];
  const CubicPatch patch = curved.patch(shell.facets()[facet]);
  return {curved.flat ? Local(Local::Zero()) : field(shell, facet).at(u, v),
          normal_of(patch, u, v)};
}

void Curvature::find_walls_of_side(const Shell& shell, int facet, int side, double t) {
  const Topology& topology = shell.topology();
  const Edge& edge = edge_at(shell, facet, side);
  const int first = shell.triangles()[shell.triangle_of_facet(facet)][side];
  std::vector<Wall>::size_type count = 0;
  Wall last;
  for (int i = 0; i < edge.count; ++i) {
    const int h = shell.facet_half_edge(topology.incidence[edge.begin + i]);
    const int other = triangle_of(h), k = side_of(h);
    const bool along = shell.triangles()[shell.triangle_of_facet(other)][k] == first;
    const auto [u, v] = on_side(k, along ? t : 1 - t);
    const Wall here = wall(shell, other, u, v);
    if (count > 0 || edge.count == 1) walls_.emplace_back(count > 0 ? last : here, here);
    last = here;
    ++count;
  }
}

void Curvature::find_walls_of_vertex(const Shell& shell, int facet, int corner) {
  const Topology& topology = shell.topology();
  const int vertex = shell.triangles()[shell.triangle_of_facet(facet)][corner];
  const auto wall_at = [&](int c) {
    const auto [u, v] = corner_parameters(c % 3);
    return wall(shell, c / 3, u, v);
  };
  std::vector<int> corners(1, 3 * facet + corner);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const int c = corners[i];
    for (int side : {c % 3, previous_corner(c % 3)}) {
      const Edge& edge = edge_at(shell, c / 3, side);
      for (int n = 0; n < edge.count; ++n) {
        const int other =
            corner_of(shell, shell.facet_half_edge(topology.incidence[edge.begin + n]), vertex);
        if (std::find(corners.begin(), corners.end(), other) != corners.end()) continue;
        corners.push_back(other);
      }
    }
  }
  // The creases that leave the vertex, each once; without one, the only wall.
  for (int c : corners) {
    const Wall here = wall_at(c);
    for (int side : {c % 3, previous_corner(c % 3)}) {
      const Edge& edge = edge_at(shell, c / 3, side);
      for (int n = 0; n < edge.count; ++n) {
        const int other =
            corner_of(shell, shell.facet_half_edge(topology.incidence[edge.begin + n]), vertex);
        if (other <= c) continue;
        const Wall there = wall_at(other);
        if (!is_same(here.normal, there.normal)) walls_.emplace_back(here, there);
      }
    }
  }
  if (walls_.empty()) walls_.emplace_back(wall_at(corners[0]), wall_at(corners[0]));
}

// The tensors at a third and two thirds of a side, as the fits of the element say.
std::pair<Curvature::Tensor, Curvature::Tensor> Curvature::along_side(const Shell& shell, int facet,
                                                                      int side) {
  const CurvedFacet& curved = shell.curved()->facets()[facet];
  if (curved.flat) return {Tensor::Zero(), Tensor::Zero()};
  const CubicCurve curve = curved.side(shell.facets()[facet], side);
  // Copies: the second one may move the first.
  const VertexCurvature from = fan(shell, facet, side).fit;
  const VertexCurvature to = fan(shell, facet, next_corner(side)).fit;
  return {tensor(from.tensor() + from.change(curve.tangent(0)) / 3),
          tensor(to.tensor() - to.change(curve.tangent(1)) / 3)};
}

// Where two surfaces of other curvatures meet smoothly, the flatter one's holds on their border: it
// has the larger elements. The half-edge, given in facets, whose element says what holds.
int Curvature::owner_of_side(const Shell& shell, int facet, int side) {
  const int other = joined_over(shell, facet, side);
  if (other < 0 || !is_jump(shell, facet, triangle_of(other))) return 3 * facet + side;
  const auto here = along_side(shell, facet, side);
  const auto there = along_side(shell, triangle_of(other), side_of(other));
  return there.first.squaredNorm() + there.second.squaredNorm() <
                 here.first.squaredNorm() + here.second.squaredNorm()
             ? other
             : 3 * facet + side;
}

const Curvature::Field& Curvature::field(const Shell& shell, int facet) {
  const auto found = field_of_.find(facet);
  if (found != field_of_.end()) return fields_[found->second];
  // Bezier ordinates: at the corners, at a third and two thirds of each side, in the middle.
  Tensor corner[3], first[3], last[3];
  Tensor middle = Tensor::Zero();
  for (int k = 0; k < 3; ++k) {
    const Fan& here = fan(shell, facet, k);
    corner[k] = here.tensor;
    middle -= tensor(here.fit.tensor()) / 6;
    std::tie(first[k], last[k]) = along_side(shell, facet, k);
    middle += (first[k] + last[k]) / 4;
    const int owner = owner_of_side(shell, facet, k);
    if (owner != 3 * facet + k) {
      std::tie(first[k], last[k]) = along_side(shell, triangle_of(owner), side_of(owner));
      if (is_reversed(shell, 3 * facet + k, owner)) std::swap(first[k], last[k]);
    }
  }
  Field made;
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
  made.rise = rise_of(shell, facet);
  field_of_.emplace(facet, static_cast<int>(fields_.size()));
  fields_.push_back(made);
  return fields_.back();
}

// How far beyond a point of an element the surface lies, along the normal there: the mean of what
// the fits at the corners say, each weighted by the square of its coordinate.
double Curvature::beyond(const Shell& shell, int facet, double u, double v) {
  const CurvedFacet& curved = shell.curved()->facets()[facet];
  if (curved.flat) return 0;
  const CubicPatch patch = curved.patch(shell.facets()[facet]);
  const double b[3] = {1 - u - v, u, v};
  const Vec3 point = patch.point(u, v), normal = normal_of(patch, u, v);
  double sum = 0, weights = 0;
  for (int k = 0; k < 3; ++k) {
    if (b[k] < 1e-9) continue;
    sum += b[k] * b[k] * fan(shell, facet, k).fit.beyond(point, normal);
    weights += b[k] * b[k];
  }
  return sum / weights;
}

Curvature::Rise Curvature::rise_of(const Shell& shell, int facet) {
  const LargeArray<CurvedFacet>& cells = shell.curved()->facets();
  const double bulge = cells[facet].bulge;
  Rise out;
  for (int k = 0; k < 3; ++k) {
    const int owner = owner_of_side(shell, facet, k);
    const bool reversed = is_reversed(shell, 3 * facet + k, owner);
    const int other = joined_over(shell, facet, k);
    const double most =
        kLargestRise * std::min(bulge, other < 0 ? bulge : cells[triangle_of(other)].bulge);
    double at[4];
    for (int i = 0; i < 4; ++i) {
      const auto [u, v] = on_side(side_of(owner), 0.2 * (1 + (reversed ? 3 - i : i)));
      at[i] = std::clamp(beyond(shell, triangle_of(owner), u, v), -most, most);
    }
    out.set_side(k, at);
  }
  const double middle = beyond(shell, facet, 1.0 / 3, 1.0 / 3);
  out.middle =
      std::clamp(middle, -kLargestRise * bulge, kLargestRise * bulge) - out.at(1.0 / 3, 1.0 / 3)[0];
  return out;
}

// The corners of elements that are joined smoothly at a vertex, in ascending order; `all`: those of
// other curvatures as well.
void Curvature::collect_fan(const Shell& shell, int corner, bool all, std::vector<int>& corners) {
  const Topology& topology = shell.topology();
  const int vertex = vertex_of(shell, corner);
  const Vec3 normal = normal_at(shell, corner);
  corners.assign(1, corner);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const int c = corners[i];
    for (int side : {c % 3, previous_corner(c % 3)}) {
      const Edge& edge = edge_at(shell, c / 3, side);
      if (edge.count != 2) continue;
      const int h = 3 * shell.triangle_of_facet(c / 3) + side;
      const int other =
          corner_of(shell, shell.facet_half_edge(topology.other_half_edge(edge, h)), vertex);
      if (std::find(corners.begin(), corners.end(), other) != corners.end()) continue;
      if (!is_same(normal, normal_at(shell, other))) continue;
      if (all || !is_jump(shell, c / 3, other / 3)) corners.push_back(other);
    }
  }
  std::sort(corners.begin(), corners.end());
}

const Curvature::Fan& Curvature::fan(const Shell& shell, int facet, int corner) {
  const auto found = fan_of_.find(3 * facet + corner);
  if (found != fan_of_.end()) return fans_[found->second];
  // All parts of the fan, each of one surface; the flattest one's curvature holds at the vertex.
  std::vector<int> all;
  collect_fan(shell, 3 * facet + corner, true, all);
  const std::size_t first = fans_.size();
  Tensor flattest = Tensor::Constant(std::numeric_limits<double>::infinity());
  for (int c : all) {
    if (fan_of_.count(c)) continue;
    const VertexCurvature fit = fit_at(shell, c);
    for (int one : corners_) fan_of_.emplace(one, static_cast<int>(fans_.size()));
    fans_.push_back({fit, Tensor::Zero()});
    const Tensor bend = tensor(fit.tensor());
    if (bend.squaredNorm() < flattest.squaredNorm()) flattest = bend;
  }
  for (std::size_t i = first; i < fans_.size(); ++i) fans_[i].tensor = flattest;
  return fans_[fan_of_.at(3 * facet + corner)];
}

// Leaves the corners of its part of the fan in corners_.
VertexCurvature Curvature::fit_at(const Shell& shell, int corner) {
  collect_fan(shell, corner, false, corners_);
  const int first = corners_[0];
  const bool exact = shell.curved()->exact();
  around_.clear();
  const auto add_around = [&](const std::vector<int>& corners) {
    for (int c : corners)
      for (int k : {next_corner(c % 3), previous_corner(c % 3)})
        around_.push_back({shell.facets()[c / 3].corner[k], normal_at(shell, c / 3 * 3 + k)});
  };
  if (!shell.curved()->facets()[corner / 3].flat) add_around(corners_);
  if (!exact && !around_.empty()) {
    // Positions alone take more of them: the neighbors of neighbors, each once.
    for (int c : corners_)
      for (int k : {next_corner(c % 3), previous_corner(c % 3)}) {
        collect_fan(shell, c / 3 * 3 + k, false, beside_);
        add_around(beside_);
      }
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
  return fit_curvature(shell.facets()[first / 3].corner[first % 3], normal_at(shell, first),
                       around_, exact);
}

void merge_shapes(const std::vector<Contact>& contacts, const std::vector<ContactShape>& shapes,
                  std::vector<ContactShape>& shown) {
  shown.clear();
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    if (!leads(contacts, i)) continue;
    shown.push_back(shapes[i]);
    if (contacts[i].group < 0) continue;
    ContactShape& whole = shown.back();
    whole.scale = whole.depth = 0;
    whole.gradient.setZero(), whole.second.setZero(), whole.tilt_by.setZero();
    Vec3 falls = Vec3::Zero(), normal = Vec3::Zero();
    for (std::size_t k = 0; k < contacts.size(); ++k) {
      if (contacts[k].group != contacts[i].group) continue;
      whole.scale += contacts[k].weight * shapes[k].scale;
      whole.gradient += contacts[k].weight * shapes[k].gradient;
      whole.second += contacts[k].weight * shapes[k].second;
      whole.tilt_by += contacts[k].weight * shapes[k].tilt_by;
      whole.depth += contacts[k].weight * shapes[k].depth;
      normal += contacts[k].weight * contacts[k].normal;
      falls += contacts[k].weight * (contacts[k].normal + shapes[k].tilt);
    }
    whole.tilt = falls - normal.normalized();
  }
}

}  // namespace sphshell
