#include "library/checks.hpp"
#include "library/impl.hpp"
#include "shell/cleaning/mending.hpp"

namespace sphshell_pin {
namespace {

using Vec3 = Eigen::Vector3d;
using core::Triangle;

// As sphshell_pin/shell/polygons.py has them, and options.py.
constexpr double kFlatArea = 1e-12;  // over the square of the longest edge
constexpr double kEqualShape = 1e-9;
constexpr double kWeldTolerance = 1e-7;  // over the diagonal
constexpr double kLeastSize = 1e-12, kMostSize = 1e15;

std::array<int, 4> corners_of(const Element& e) { return {e.first, e.second, e.third, e.fourth}; }

// As in "vertex 3", counted from 0.
std::string numbered(const char* what, std::size_t k) { return what + (" " + std::to_string(k)); }

// Finite vertices, and elements of three or four that exist; what they form is checked later.
void check_surface(const Points& vertices, const std::vector<Element>& elements) {
  if (vertices.size() < 3)
    throw InvalidShell("a surface needs at least 3 vertices; " + std::to_string(vertices.size()) +
                       " given");
  for (std::size_t i = 0; i < vertices.size(); ++i)
    if (!vertices[i].allFinite())
      throw InvalidShell(numbered("vertex", i) + " is not finite: " + shown_all(vertices[i]));
  if (elements.empty()) throw InvalidShell("a surface needs at least one element; none given");
  const auto count = static_cast<long long>(vertices.size());
  for (std::size_t k = 0; k < elements.size(); ++k) {
    const std::array<int, 4> corners = corners_of(elements[k]);
    for (int i = 0; i < 4; ++i) {
      if (i == 3 && corners[i] == -1) continue;
      if (corners[i] < 0 || corners[i] >= count)
        throw InvalidShell(numbered("element", k) + " uses vertex " + std::to_string(corners[i]) +
                           ", but the " + std::to_string(count) + " vertices are numbered 0 to " +
                           std::to_string(count - 1) + ": correct the index");
    }
  }
}

// The square of the longest edge [m^2].
double longest_edge2(const Vec3& a, const Vec3& b, const Vec3& c) {
  return std::max({(b - a).squaredNorm(), (c - a).squaredNorm(), (c - b).squaredNorm()});
}

// Whether the corners lie on one line, or in one point.
bool is_flat(const Points& p, const Triangle& t) {
  const Vec3 &a = p[t[0]], &b = p[t[1]], &c = p[t[2]];
  const double longest = longest_edge2(a, b, c);
  return !((b - a).cross(c - a).norm() > 2 * kFlatArea * longest);
}

// Whether a quad is split between its corners 1 and 3, and not 0 and 2, as examine_quads in
// sphshell_pin/shell/polygons.py does: by the diagonal whose worse triangle has the better shape;
// of equal ones by that at the smallest point, which does not depend on the numbering.
bool other_diagonal(const std::array<Vec3, 4>& p) {
  Vec3 normal = (p[2] - p[0]).cross(p[3] - p[1]);
  const double length = normal.norm();
  if (length > 0) normal /= length;
  const auto shape = [&](int i, int j, int k) {
    const double longest = longest_edge2(p[i], p[j], p[k]);
    return (p[j] - p[i]).cross(p[k] - p[i]).dot(normal) / (longest > 0 ? longest : 1);
  };
  const double first = std::min(shape(0, 1, 2), shape(2, 3, 0));
  const double second = std::min(shape(3, 0, 1), shape(1, 2, 3));
  if (std::abs(first - second) > kEqualShape) return second > first;
  int least = 0;
  for (int k = 1; k < 4; ++k)
    if (std::lexicographical_compare(p[k].data(), p[k].data() + 3, p[least].data(),
                                     p[least].data() + 3))
      least = k;
  return least == 1 || least == 3;
}

// One triangle, or two.
std::vector<Triangle> split(const Points& p, const Element& e) {
  if (e.fourth < 0) return {{e.first, e.second, e.third}};
  if (other_diagonal({p[e.first], p[e.second], p[e.third], p[e.fourth]}))
    return {{e.first, e.second, e.fourth}, {e.second, e.third, e.fourth}};
  return {{e.first, e.second, e.third}, {e.first, e.third, e.fourth}};
}

Vec3 unit_or_zero(const Vec3& x) {
  // Divided by the largest component first: squares of tiny numbers would vanish.
  const double largest = x.cwiseAbs().maxCoeff();
  return largest > 0 ? Vec3((x / largest).normalized()) : Vec3(Vec3::Zero());
}

// Options by themselves, before anything is built.
void check(const ShellOptions& options, std::size_t vertices) {
  const double angle = options.crease_angle;
  if (!(angle >= 0 && angle <= M_PI))
    throw InvalidParameter("crease_angle", shown(angle), "must lie between 0 and pi [rad]");
  const int side = static_cast<int>(options.side);
  if (side < 0 || side > 2)
    throw InvalidParameter("side", std::to_string(side), "must be Side::Both, Outside or Inside");
  const Points& normals = options.normals;
  if (!normals.empty() && normals.size() != vertices)
    throw InvalidShell("normals must be one per vertex: " + std::to_string(normals.size()) +
                       " given for " + std::to_string(vertices) + " vertices");
  for (std::size_t i = 0; i < normals.size(); ++i)
    if (!normals[i].allFinite())
      throw InvalidShell(numbered("normal", i) + " is not finite: " + shown_all(normals[i]));
}

// The diagonal of the box, of the vertices that elements use.
void check_box(const Points& vertices, const std::vector<Triangle>& triangles) {
  const double size = core::bounds(vertices, triangles).diagonal().norm();
  // Squares of single-precision numbers must neither vanish nor overflow.
  if (!(size >= kLeastSize && size <= kMostSize))
    throw InvalidShell("the shell's box has a diagonal of " + shown(size) +
                       " m: it must be between 1e-12 and 1e15 m, as the search tree is in single "
                       "precision; choose another unit");
}

}  // namespace

Shell::Shell(Points vertices, const std::vector<Element>& elements, const ShellOptions& options) {
  check_surface(vertices, elements);
  check(options, vertices.size());
  auto made = std::make_shared<Impl>();
  std::vector<Triangle> triangles;
  std::vector<int> owner;
  for (std::size_t k = 0; k < elements.size(); ++k) {
    // Checked element by element: the first fault is reported with its number.
    const std::vector<Triangle> parts = split(vertices, elements[k]);
    Vec3 area = Vec3::Zero();
    for (const Triangle& t : parts) {
      if (is_flat(vertices, t))
        throw InvalidShell(numbered("element", k) + " has no area" +
                           (parts.size() > 1 ? " in one of its halves" : "") +
                           ": drop it, as weld() does");
      area += (vertices[t[1]] - vertices[t[0]]).cross(vertices[t[2]] - vertices[t[0]]);
      triangles.push_back(t);
      owner.push_back(static_cast<int>(k));
    }
    if (options.normals.empty()) continue;
    for (const Triangle& t : parts) {
      for (const int corner : t) {
        const Vec3 normal = unit_or_zero(options.normals[corner]);
        // Where there is none, that of the element.
        made->normals.push_back(normal.isZero(0) ? unit_or_zero(area) : normal);
      }
    }
  }
  check_box(vertices, triangles);
  made->shell =
      std::make_shared<core::Shell>(std::move(vertices), std::move(triangles), std::move(owner),
                                    options.crease_angle, static_cast<core::Side>(options.side));
  impl_ = std::move(made);
}

Shell::Shell(const Surface& surface, const ShellOptions& options)
    : Shell(surface.vertices, surface.elements, options) {}

const Points& Shell::vertices() const { return impl_->shell->vertices(); }
int Shell::num_elements() const { return impl_->shell->num_elements(); }
double Shell::size() const { return impl_->shell->size(); }
double Shell::crease_angle() const { return impl_->shell->crease_angle(); }
Side Shell::side() const { return static_cast<Side>(impl_->shell->side()); }

Surface weld(const Surface& surface, double tolerance) {
  check_not_negative("tolerance", tolerance, " [m]");
  check_surface(surface.vertices, surface.elements);
  Eigen::AlignedBox3d box;
  for (const Vec3& v : surface.vertices) box.extend(v);
  if (tolerance == 0) tolerance = kWeldTolerance * box.diagonal().norm();
  const core::Weld merged =
      core::weld({surface.vertices.front().data(), surface.vertices.size()}, tolerance);
  Surface out;
  // Of each vertex its place among those that are kept, in the order in which elements use them.
  std::vector<int> place(surface.vertices.size(), -1);
  const auto placed = [&](int vertex) {
    if (place[vertex] < 0) {
      place[vertex] = static_cast<int>(out.vertices.size());
      out.vertices.push_back(surface.vertices[vertex]);
    }
    return place[vertex];
  };
  const Points& points = surface.vertices;
  for (const Element& given : surface.elements) {
    std::vector<int> kept;
    for (const int corner : corners_of(given))
      if (corner >= 0 && (kept.empty() || merged.representative[corner] != kept.back()))
        kept.push_back(merged.representative[corner]);
    if (kept.size() > 1 && kept.front() == kept.back()) kept.pop_back();
    if (kept.size() < 3) continue;
    const Element element{kept[0], kept[1], kept[2], kept.size() > 3 ? kept[3] : -1};
    std::vector<Triangle> parts = split(points, element);
    const std::size_t all = parts.size();
    core::erase_if(parts, [&](const Triangle& t) { return is_flat(points, t); });
    // A quad with one flat half becomes the triangle of the other half.
    if (parts.size() == all) {
      const int fourth = element.fourth;
      out.elements.push_back({placed(element.first), placed(element.second), placed(element.third),
                              fourth < 0 ? -1 : placed(fourth)});
    } else {
      for (const Triangle& t : parts)
        out.elements.push_back({placed(t[0]), placed(t[1]), placed(t[2])});
    }
  }
  if (out.elements.empty())
    throw InvalidShell("no element of the surface has an area after welding within " +
                       shown(tolerance) + " m");
  return out;
}

}  // namespace sphshell_pin
