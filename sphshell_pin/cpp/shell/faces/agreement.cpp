// Tangent faces that were fitted one by one miss each other by the rounding of their vertices: they
// are fitted once more, together.
#include <Eigen/Dense>

#include "shell/disjoint_sets.hpp"
#include "shell/faces/recognizer.hpp"

namespace sphshell {
namespace {

// Where the normals of faces differ by more (sine), a vertex is moved onto both of them.
constexpr double kNearlyTangent = 0.1;
// That faces agree counts so many times more than where vertices are.
constexpr double kAgreement = 1e6;
constexpr int kMostJointFits = 6;
// Unknowns that nothing determines, as turns about an axis, stay.
constexpr double kDamping = 1e-11;
// More faces in a chain of tangent ones, and more vertices of one, are left as they are.
constexpr std::size_t kMostFaces = 120, kMostPoints = 300;

// How the distance of a point changes with a motion of the shape, a turn about `center` (in lengths
// at one size from there), and with both of its numbers (an angle also times the size).
using Slopes = Eigen::Matrix<double, 8, 1>;
Slopes row_of(const Primitive& p, const Vec3& center, double size, const Vec3& x, const Vec3& n) {
  const Vec3 y = x - p.point;
  const double h = y.dot(p.axis);
  const Vec3 out = (y - h * p.axis).normalized();
  const bool turned = p.kind == FaceKind::Cone || p.kind == FaceKind::Torus;
  Slopes row;
  row << -n, -(x - center).cross(n) / size, turned ? -n.dot(out) : -1, 0;
  if (p.kind == FaceKind::Torus) row[7] = -1;
  if (p.kind == FaceKind::Cone) {
    const Vec3 ruling = std::sin(p.second) * out + std::cos(p.second) * p.axis;
    row[7] = -ruling.dot(y - p.radius * out) / size;
  }
  return row;
}

void move(Primitive& p, const Vec3& center, double size, const Eigen::VectorXd& x) {
  const Vec3 turn = x.segment<3>(3) / size;
  p.point += x.head<3>() + turn.cross(p.point - center);
  p.axis = (p.axis + turn.cross(p.axis)).normalized();
  p.radius += x[6];
  p.second += p.kind == FaceKind::Cone ? x[7] / size : x[7];
}

// Vertices at which two faces are nearly tangent; `sign`: of one shape's normals along the other's.
struct Contacts {
  int a, b;
  double sign;
  std::vector<Vec3> points;
};

// The largest; infinite where any is not finite.
double disagreement(const std::vector<Primitive>& shapes,
                    const std::vector<const Contacts*>& contacts) {
  double most = 0;
  for (const Contacts* one : contacts)
    for (const Vec3& x : one->points)
      most = std::max(
          most, std::abs(shapes[one->b].distance(x) - one->sign * shapes[one->a].distance(x)));
  return std::isfinite(most) ? most : std::numeric_limits<double>::infinity();
}

// Gauss-Newton on the distances of vertices from their faces, and on their differences: of round
// faces of one chain, and all contacts of any of them.
void settle(const std::vector<int>& faces, const std::vector<const Contacts*>& contacts,
            const std::vector<std::vector<Vec3>>& points, double size, double tolerance,
            std::vector<Primitive>& shapes) {
  const std::vector<Primitive> before = shapes;
  std::map<int, int> at;
  std::vector<Vec3> centers;
  for (const int f : faces) {
    at[f] = 8 * static_cast<int>(at.size());
    centers.push_back(points[f].front());
  }
  const auto unknowns = Eigen::Index(8 * faces.size());
  double worst = disagreement(shapes, contacts), first = worst;
  for (int round = 0; round < kMostJointFits; ++round) {
    Eigen::MatrixXd square = Eigen::MatrixXd::Zero(unknowns, unknowns);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(unknowns);
    const auto row_at = [&](int f, const Vec3& x, double& off) {
      Vec3 n;
      off = shapes[f].distance(x, n);
      return row_of(shapes[f], centers[at[f] / 8], size, x, n);
    };
    double off = 0, other = 0;
    for (const int f : faces)
      for (const Vec3& x : points[f]) {
        const Slopes row = row_at(f, x, off);
        square.block<8, 8>(at[f], at[f]) += row * row.transpose();
        right.segment<8>(at[f]) -= off * row;
      }
    for (const Contacts* one : contacts)
      for (const Vec3& x : one->points) {
        // The first may be a plane, which stays.
        const Slopes row = row_at(one->b, x, off);
        const bool plane = shapes[one->a].kind == FaceKind::Plane;
        const Slopes back =
            plane ? Slopes(Slopes::Zero()) : Slopes(one->sign * row_at(one->a, x, other));
        if (plane) other = shapes[one->a].distance(x);
        const double apart = off - one->sign * other;
        const int i = at[one->b], j = plane ? i : at[one->a];
        square.block<8, 8>(i, i) += kAgreement * row * row.transpose();
        right.segment<8>(i) -= kAgreement * apart * row;
        if (plane) continue;
        square.block<8, 8>(j, j) += kAgreement * back * back.transpose();
        square.block<8, 8>(i, j) -= kAgreement * row * back.transpose();
        square.block<8, 8>(j, i) -= kAgreement * back * row.transpose();
        right.segment<8>(j) += kAgreement * apart * back;
      }
    square.diagonal().array() += kDamping * square.diagonal().maxCoeff() / kAgreement;
    const Eigen::VectorXd step = square.ldlt().solve(right);
    if (!step.allFinite()) break;
    for (const int f : faces) move(shapes[f], centers[at[f] / 8], size, step.segment<8>(at[f]));
    worst = disagreement(shapes, contacts);
  }
  // Kept if they agree better and still go through their vertices.
  bool kept = worst < first;
  for (const int f : faces)
    for (const Vec3& x : points[f])
      kept = kept && std::abs(shapes[f].distance(x)) <=
                         std::max(tolerance, 2 * std::abs(before[f].distance(x)));
  if (!kept) shapes = before;
}

}  // namespace

void agree_on_borders(const Shell& shell, Faces& faces, double tolerance) {
  const auto is_plane = [&](int f) { return faces.shapes[f].kind == FaceKind::Plane; };
  const std::vector<std::vector<int>> around = faces_at_vertices(shell, faces);
  std::vector<std::vector<Vec3>> points(faces.shapes.size());
  std::map<std::pair<int, int>, Contacts> contacts;
  DisjointSets chains(faces.shapes.size());
  for (std::size_t v = 0; v < around.size(); ++v)
    for (const int f : around[v]) {
      const Vec3& x = shell.vertices()[v];
      points[f].push_back(x);
      for (const int g : around[v]) {
        // Planes first; one of each pair.
        if (is_plane(g) || (is_plane(f) ? false : f >= g)) continue;
        Vec3 n, m;
        faces.shapes[f].distance(x, n), faces.shapes[g].distance(x, m);
        if (!(n.cross(m).norm() < kNearlyTangent)) continue;
        Contacts& all = contacts[{f, g}];
        all.a = f, all.b = g, all.sign = n.dot(m) < 0 ? -1 : 1;
        all.points.push_back(x);
        if (!is_plane(f)) chains.merge(f, g);
      }
    }
  for (std::vector<Vec3>& some : points) {
    const std::size_t n = some.size(), take = std::min(n, kMostPoints);
    for (std::size_t i = 0; i < take; ++i) some[i] = some[i * n / take];
    some.resize(take);
  }
  std::map<int, std::pair<std::vector<int>, std::vector<const Contacts*>>> by_chain;
  for (const auto& [pair, some] : contacts) by_chain[chains.find(some.b)].second.push_back(&some);
  for (std::size_t f = 0; f < points.size(); ++f)
    if (!is_plane(int(f)) && !points[f].empty())
      by_chain[chains.find(int(f))].first.push_back(int(f));
  for (const auto& [root, chain] : by_chain)
    if (!chain.second.empty() && chain.first.size() <= kMostFaces)
      settle(chain.first, chain.second, points, shell.size(), tolerance, faces.shapes);
}

}  // namespace sphshell
