// Vertices and curves of elements, moved onto the faces that they are off by rounding.
#include <Eigen/Dense>

#include "shell/faces/face_cells.hpp"
#include "shell/faces/recognizer.hpp"

namespace sphshell {
namespace {

constexpr int kMostSnaps = 8;
// Faces are tangent that come as near as this to each other, over the size.
constexpr double kTouch = 1e-14;
// Curves are settled on faces in so many rounds, by at most this share of their chord.
constexpr int kMostSettlings = 3;
constexpr double kMostSettled = 0.02;
// A triangle may turn by 25 degrees (cosine): beyond that, its height is of the rounding.
constexpr double kLeastAlike = 0.9;

// Moves x onto all shapes by Newton's method, each along what earlier ones leave free. False if it
// goes farther than `tolerance`. A shape that is tangent to an earlier one, to rounding at `size`,
// leaves open where on it x is: where both have one normal.
bool onto_all(const std::vector<Primitive>& shapes, const std::vector<int>& faces, double size,
              double tolerance, Vec3& x) {
  const Vec3 before = x;
  for (int i = 0; i < kMostSnaps; ++i) {
    // Gram-Schmidt on the normals: at most three faces determine a point.
    Vec3 step = Vec3::Zero(), free[3];
    int count = 0;
    const auto move_along = [&](const Vec3& n, double off) {
      Vec3 along = n;
      for (int k = 0; k < count; ++k) along -= along.dot(free[k]) * free[k];
      const double sine = along.norm();
      if (count == 3 || !(sine > kLeastAngle)) return false;
      step -= (off + n.dot(step)) / sine * (free[count++] = along / sine);
      return true;
    };
    for (const int f : faces) {
      Vec3 n, m;
      const double off = shapes[f].distance(x, n);
      if (move_along(n, off)) continue;
      for (const int g : faces) {
        if (g == f) break;
        const double other = shapes[g].distance(x, m);
        if (!(n.cross(m).norm() < kLeastAngle)) continue;
        const double sign = n.dot(m) < 0 ? -1 : 1;
        // Across their border both turn apart most.
        const Eigen::SelfAdjointEigenSolver<Mat3> turn(
            Mat3(shapes[f].hessian(x) - sign * shapes[g].hessian(x)));
        const int most = -turn.eigenvalues()[0] > turn.eigenvalues()[2] ? 0 : 2;
        const double bend = turn.eigenvalues()[most];
        const Vec3 across = turn.eigenvectors().col(most);
        const double aside = across.dot(n - sign * m) / bend;
        if (std::abs(off - sign * other - bend / 2 * aside * aside) <= kTouch * size)
          move_along(across, aside);
        break;
      }
    }
    x += step;
    if (!((x - before).norm() <= tolerance)) return false;
    if (step.squaredNorm() < 1e-32 * x.squaredNorm()) break;
  }
  return true;
}

// Moves the control points of an edge as little as puts four points of it onto a shape: Newton's
// method. Of what remains between them, of order 6 in the turn, a cubic is free in order 4 only
// where its handles may change as well.
void settle_on_one(const Primitive& shape, const Vec3& begin, const Vec3& d,
                   std::array<Vec3, 2>& offset) {
  constexpr double kLeastShare = 1e-5;  // of the largest singular value
  for (int repeat = 0; repeat < kMostSettlings; ++repeat) {
    Eigen::Matrix<double, 4, 6> by;
    Eigen::Vector4d off;
    for (int i = 0; i < 4; ++i) {
      const double t = (i + 1) / 5.0, b1 = 3 * t * (1 - t) * (1 - t), b2 = 3 * t * t * (1 - t);
      Vec3 n;
      off[i] = shape.distance(begin + t * d + b1 * offset[0] + b2 * offset[1], n);
      by.row(i) << b1 * n.transpose(), b2 * n.transpose();
    }
    Eigen::CompleteOrthogonalDecomposition<Eigen::Matrix<double, 4, 6>> solver;
    solver.setThreshold(kLeastShare);
    const Eigen::Matrix<double, 6, 1> step = solver.compute(by).solve(off);
    for (int k = 0; k < 2; ++k) offset[k] -= step.segment<3>(3 * k);
  }
}

// Moves them so that the points at a third of the edge are on all faces; planes have the last word.
void settle_on_all(const Faces& faces, const std::vector<int>& around, const Vec3& begin,
                   const Vec3& d, std::array<Vec3, 2>& offset) {
  for (int repeat = 0; repeat < kMostSettlings; ++repeat)
    for (const bool flat : {false, true})
      for (const int face : around) {
        if (face < 0) continue;
        const Primitive& shape = faces.shapes[face];
        if ((shape.kind == FaceKind::Plane) != flat) continue;
        Vec3 off[2];
        for (int k = 0; k < 2; ++k) {
          // Bernstein's polynomials at a third are 4/9 and 2/9.
          const Vec3 x = begin + (k + 1) / 3.0 * d + (4 * offset[k] + 2 * offset[1 - k]) / 9;
          const double distance = shape.distance(x, off[k]);
          off[k] *= distance;
        }
        for (int k = 0; k < 2; ++k) offset[k] -= 3 * off[k] - 1.5 * off[1 - k];
      }
}

}  // namespace

std::vector<std::vector<int>> faces_at_vertices(const Shell& shell, const Faces& faces) {
  std::vector<std::vector<int>> out(shell.vertices().size());
  for (std::size_t t = 0; t < faces.of.size(); ++t)
    for (const int v : shell.triangles()[t])
      if (const int f = faces.of[t];
          f >= 0 && std::find(out[v].begin(), out[v].end(), f) == out[v].end())
        out[v].push_back(f);
  return out;
}

std::vector<Vec3> snapped_vertices(const Shell& shell, const Faces& faces, double tolerance) {
  const auto flat = [](const Primitive& one) { return one.kind == FaceKind::Plane; };
  // Flat elements are on planes as they are.
  if (std::all_of(faces.shapes.begin(), faces.shapes.end(), flat)) return {};
  const std::vector<Vec3>& before = shell.vertices();
  std::vector<std::vector<int>> around = faces_at_vertices(shell, faces);
  std::vector<Vec3> out = before;
  bool any = false;
  for (std::size_t v = 0; v < out.size(); ++v) {
    // Planes first: they are exact, and the other faces give way.
    std::stable_partition(around[v].begin(), around[v].end(),
                          [&](int f) { return flat(faces.shapes[f]); });
    if (onto_all(faces.shapes, around[v], shell.size(), tolerance, out[v])) continue;
    around[v].erase(std::find_if_not(around[v].begin(), around[v].end(),
                                     [&](int f) { return flat(faces.shapes[f]); }),
                    around[v].end());
    out[v] = before[v];
    if (!onto_all(faces.shapes, around[v], shell.size(), tolerance, out[v])) out[v] = before[v];
  }
  for (std::size_t v = 0; v < out.size(); ++v)
    any = any || (out[v] - before[v]).norm() > kMostGap * shell.size();
  if (!any) return {};
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t i = 0; i < shell.triangles().size(); ++i) {
      const Triangle& t = shell.triangles()[i];
      const int face = faces.of_triangle(static_cast<int>(i));
      const auto normal = [&](const std::vector<Vec3>& p) {
        return (p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]]).normalized();
      };
      const auto turned = [&](const std::vector<Vec3>& p) {
        if (face < 0) return 0;
        if (!flat(faces.shapes[face]))
          return turned_on(faces.shapes[face], {p[t[0]], p[t[1]], p[t[2]]}, 0);
        return faces.shapes[face].axis.dot((p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]])) < 0 ? -1
                                                                                             : 1;
      };
      const bool moved =
          out[t[0]] != before[t[0]] || out[t[1]] != before[t[1]] || out[t[2]] != before[t[2]];
      // Put back where a triangle would turn over; that may spoil a neighbor, so it is repeated.
      // The normal of a needle turns by its rounding, but it stays where it is on its face.
      if (!moved || normal(out).dot(normal(before)) > kLeastAlike) continue;
      if (const int side = turned(out); side != 0 && side == turned(before)) continue;
      for (const int v : t) out[v] = before[v];
      changed = true;
    }
  }
  return out;
}

void settle_on_faces(const Shell& shell, const Edge& edge, const Faces& faces, const Vec3& begin,
                     const Vec3& d, std::array<Vec3, 2>& offset) {
  if (faces.of.empty() || edge.kind == EdgeClass::Boundary) return;
  std::vector<int> around;
  for (const int h : shell.topology().around(edge))
    around.push_back(faces.of_triangle(triangle_of(h)));
  // Within a face the curve has the face's own normals at its ends, which it keeps, but at the tip
  // of a cone there are none; between planes it is straight.
  bool border = false, curved = false;
  int only = -1;  // beside free-form elements
  for (const int face : around) {
    if (face >= 0) only = only == -1 || only == face ? face : -2;
    border = border || face != around[0];
    curved = curved || face < 0 || faces.shapes[face].kind != FaceKind::Plane;
  }
  const bool at_tip = around[0] >= 0 && faces.shapes[around[0]].kind == FaceKind::Cone;
  if (!curved) offset = {Vec3::Zero(), Vec3::Zero()};
  if (!(border || at_tip) || !curved) return;
  const std::array<Vec3, 2> before = offset;
  if (only >= 0 && faces.shapes[only].kind != FaceKind::Plane)
    settle_on_one(faces.shapes[only], begin, d, offset);
  else
    settle_on_all(faces, around, begin, d, offset);
  // An edge that is nowhere near its faces stays as it is.
  for (int k = 0; k < 2; ++k)
    if (!((offset[k] - before[k]).norm() <= kMostSettled * d.norm())) offset = before;
}

}  // namespace sphshell
