// Whether the vertices of a region over-determine its primitive: three points lie on a circle, two
// circles on a sphere, any three rings on a torus.
#include <Eigen/Dense>

#include "shell/faces/recognizer.hpp"

namespace sphshell {
namespace {

constexpr std::size_t kMoreThanParameters = 3;
// Of a region that is symmetric half of the vertices tell, of a torus five parameters.
constexpr std::size_t kVerticesOfTorus = 2 * (5 + kMoreThanParameters);
// Flat sides stand off by this many tolerances: less is rounding.
constexpr double kLeastDeviation = 4;
// Within so many tolerances a vertex has left slowly; a share of those beside a region.
constexpr double kDrift = 4, kMostDrifting = 0.3;
// The tolerance may tilt a facet by this share of what it leans.
constexpr double kMostTilt = 0.05;
// Equal steps agree to this share.
constexpr double kEqualSteps = 2e-3;
// Regions that are larger have vertices inside.
constexpr std::size_t kSmall = 400;
// The smallest singular value of a sphere's equations over the largest: below, a flat cap.
constexpr double kLeastSingular = 2e-3;

// The values that differ by more than `gap`.
std::vector<double> distinct(std::vector<double> values, double gap) {
  std::sort(values.begin(), values.end());
  std::size_t kept = 0;
  double last = 0;
  for (const double x : values) {
    if (kept == 0 || x - last > gap) values[kept++] = x;
    last = x;
  }
  values.resize(kept);
  return values;
}

// Angles that follow each other in equal steps, but for the gap where a part of the circle ends.
bool are_equal_steps(const std::vector<double>& angles) {
  std::vector<double> steps;
  for (std::size_t i = 0; i < angles.size(); ++i)
    steps.push_back(i + 1 < angles.size() ? angles[i + 1] - angles[i]
                                          : angles[0] + 2 * M_PI - angles[i]);
  // The largest step is the gap of an arc.
  steps.erase(std::max_element(steps.begin(), steps.end()));
  const auto [least, most] = std::minmax_element(steps.begin(), steps.end());
  double mean = 0;
  for (const double s : steps) mean += s / double(steps.size());
  return *most - *least < kEqualSteps * mean;
}

// So many distinct angles, or one less in equal steps, as who samples a circle makes them.
bool enough(const std::vector<double>& angles, std::size_t many) {
  return angles.size() >= many || (angles.size() + 1 == many && are_equal_steps(angles));
}

}  // namespace

// Vertices all of whose edges are inside the region.
std::vector<int> Recognizer::inner_vertices(const Growth& growth) {
  mark(growth.triangles);
  const Topology& topology = shell_.topology();
  std::vector<int> border;
  for (const int t : growth.triangles)
    for (int k = 0; k < 3; ++k) {
      const int u = topology.neighbor(3 * t + k);
      if (u >= 0 && is_marked(u)) continue;
      const Edge& edge = topology.edge_at(3 * t + k);
      border.insert(border.end(), {edge.first_vertex, edge.last_vertex});
    }
  std::sort(border.begin(), border.end());
  std::vector<int> out;
  for (const int v : vertices_of(growth.triangles))
    if (!std::binary_search(border.begin(), border.end(), v)) out.push_back(v);
  return out;
}

// A single strip of facets, all of its vertices on its border: perhaps a zone of something rounder.
bool Recognizer::is_weak(const Growth& growth) {
  return (growth.shape.kind == FaceKind::Cylinder || growth.shape.kind == FaceKind::Cone) &&
         growth.triangles.size() < kSmall && inner_vertices(growth).empty();
}

// A region that ends where the surface slowly leaves the shape osculates a free one: beyond the
// border of a face the next vertices are several tolerances off at once.
bool Recognizer::drifts_away(const Growth& growth) {
  mark(growth.triangles);
  std::size_t leaving = 0, slowly = 0;
  for_each_beside(growth.triangles, [&](int u) {
    const double most = off(u, growth.shape);
    leaving += most > growth.window;
    slowly += most > growth.window && most < kDrift * growth.window;
  });
  return double(slowly) > kMostDrifting * double(leaving);
}

bool Recognizer::is_over_determined(const Growth& growth) {
  const Primitive& s = growth.shape;
  const std::vector<int>& triangles = growth.triangles;
  const std::vector<int> vertices = vertices_of(triangles);
  if (triangles.size() < 3 ||
      vertices.size() < std::size_t(num_parameters(s.kind)) + kMoreThanParameters ||
      (s.kind == FaceKind::Torus && vertices.size() < kVerticesOfTorus) ||
      growth.deviation < kLeastDeviation * growth.window || !(s.radius > 0) || drifts_away(growth))
    return false;
  // What a facet leans must be more than the tolerance could tilt it by: else its normal says
  // nothing.
  std::vector<double> leans, tilts;
  for (const int t : triangles) {
    leans.push_back(lean(t, s));
    tilts.push_back(growth.window * longest_side(t) / std::max(2 * area(t), 1e-300));
  }
  if (median(tilts) > kMostTilt * median(leans)) return false;
  // Small round regions need vertices inside: on a border alone many surfaces fit.
  const bool round = s.kind == FaceKind::Sphere || s.kind == FaceKind::Torus;
  if (round && triangles.size() < kSmall && inner_vertices(growth).size() < 2) return false;
  if (s.kind == FaceKind::Sphere) {
    if (vertices.size() < 9) return false;
    Eigen::Matrix4d square = Eigen::Matrix4d::Zero();
    Mat3 spread = Mat3::Zero(), turn = Mat3::Zero();
    Vec3 middle = Vec3::Zero(), mean = Vec3::Zero(), n;
    for (const int v : vertices) middle += point(v) / double(vertices.size());
    for (const int t : triangles) mean += facet_normal(t) / double(triangles.size());
    for (const int v : vertices) {
      s.distance(point(v), n);
      // The Jacobian of distances by center and radius: nearly singular for a flat cap.
      const Eigen::Vector4d row(n.x(), n.y(), n.z(), 1);
      square += row * row.transpose();
      spread += (point(v) - middle) * (point(v) - middle).transpose();
    }
    for (const int t : triangles)
      turn += (facet_normal(t) - mean) * (facet_normal(t) - mean).transpose();
    const Eigen::Vector4d values =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d>(square, Eigen::EigenvaluesOnly)
            .eigenvalues();
    if (!(values[0] > kLeastSingular * kLeastSingular * values[3])) return false;
    // Two parallel circles lie on a sphere, and so do three that are symmetric.
    std::vector<Vec3> axes;
    for (const Mat3& m : {spread, turn}) {
      const Mat3 vectors = eigenvectors(m);
      for (int k = 0; k < 3; ++k) axes.push_back(vectors.col(k));
    }
    for (const Primitive& ring : guess_primitives(FaceKind::Torus, sample(triangles)))
      axes.push_back(ring.axis);
    return std::all_of(axes.begin(), axes.end(), [&](const Vec3& axis) {
      std::vector<double> levels;
      for (const int v : vertices) levels.push_back(point(v).dot(axis));
      return distinct(std::move(levels), 20 * growth.window).size() >= 4;
    });
  }
  std::vector<double> around, across, offs;
  for (const int vertex : vertices) {
    const Place at = place_on(s, point(vertex));
    if (at.off > 10 * growth.window) around.push_back(at.around), offs.push_back(at.off);
    if (s.kind == FaceKind::Torus) across.push_back(at.across);
  }
  if (offs.empty()) return false;
  // Angles nearer than what the tolerance is at that radius are one.
  const double gap = std::max(1e-3, 10 * growth.window / std::max(median(offs), 1e-300));
  around = distinct(std::move(around), gap);
  if (s.kind != FaceKind::Torus) return enough(around, 5);
  across = distinct(std::move(across), std::max(1e-3, 10 * growth.window / s.second));
  return around.size() >= 4 && enough(across, 5);
}

}  // namespace sphshell
