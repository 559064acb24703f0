#include <sphshell_pin/query.hpp>

#include <limits>
#include <thread>

#include "check.hpp"

using namespace sphshell_pin;
using Eigen::Vector3d;

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// A cube of edge 2 about the origin, wound outwards.
Surface cube() {
  Surface out;
  for (const double z : {-1.0, 1.0})
    for (const double y : {-1.0, 1.0})
      for (const double x : {-1.0, 1.0}) out.vertices.push_back({x, y, z});
  out.elements = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                  {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  return out;
}

// A band of n quads round a cylinder of radius 1, with its own normals.
Shell cylinder(int n, bool with_normals) {
  Surface band;
  ShellOptions options;
  for (int k = 0; k < n; ++k) {
    const double angle = 2 * M_PI * k / n;
    for (const double z : {-1.0, 1.0}) {
      band.vertices.push_back({std::cos(angle), std::sin(angle), z});
      if (with_normals) options.normals.push_back({std::cos(angle), std::sin(angle), 0});
    }
    const int a = 2 * k, b = 2 * ((k + 1) % n);
    band.elements.push_back({a, b, b + 1, a + 1});
  }
  return Shell(band, options);
}

void a_cube_is_touched_on_faces_edges_and_corners() {
  const Shell shell(cube());
  CHECK(shell.num_elements() == 6);
  CHECK_NEAR(shell.size(), 2 * std::sqrt(3.0), 1e-15);
  Query query;
  for (const Method method : {Method::Facets, Method::Smooth}) {
    const std::vector<Contact> face = query.contacts(shell, {0.2, 0.1, 1.4}, 0.5, method);
    CHECK(face.size() == 1 && face[0].feature == Feature::Face && face[0].element == 1);
    CHECK_NEAR(face[0].depth, 0.1, 1e-15);
    CHECK((face[0].normal - Vector3d::UnitZ()).norm() < 1e-15);
    CHECK((face[0].point - Vector3d(0.2, 0.1, 1)).norm() < 1e-15);
    const std::vector<Contact> edge = query.contacts(shell, {0.3, 1.1, 1.1}, 0.2, method);
    CHECK(edge.size() == 1 && edge[0].feature == Feature::Edge);
    CHECK_NEAR(edge[0].depth, 0.2 - std::sqrt(0.02), 1e-15);
    const std::vector<Contact> corner = query.contacts(shell, {1.1, 1.1, 1.1}, 0.2, method);
    CHECK(corner.size() == 1 && corner[0].feature == Feature::Vertex);
    CHECK(query.terms().size() == 1 && query.terms()[0].depth == corner[0].depth);
    CHECK(query.contacts(shell, {3, 0, 0}, 0.2, method).empty());
    const ClosestPoint inside = query.closest_point(shell, {0.5, 0, 0}, method);
    CHECK_NEAR(inside.distance, -0.5, 1e-15);
    CHECK((inside.point - Vector3d::UnitX()).norm() < 1e-15 && inside.element == 5);
  }
  // ADAMS's way counts the shared edge for both elements.
  CHECK(query.contacts(shell, {0.3, 1.1, 1.1}, 0.2, Method::Elements).size() == 2);
}

void curved_elements_follow_the_true_surface() {
  Query query;
  const double angle = M_PI / 32;  // in the middle of an element of 32
  const Vector3d center(1.05 * std::cos(angle), 1.05 * std::sin(angle), 0.1);
  const auto depth = [&](const Shell& shell, Method method) {
    return query.contacts(shell, center, 0.1, method).at(0).depth;
  };
  const double flat = std::abs(depth(cylinder(32, true), Method::Facets) - 0.05);
  CHECK_NEAR(flat, 1 - std::cos(angle), 1e-12);
  CHECK(std::abs(depth(cylinder(32, true), Method::Smooth) - 0.05) < 5e-5);
  CHECK(std::abs(depth(cylinder(32, false), Method::Smooth) - 0.05) < 5e-5);
  // With no smooth edges every element is flat.
  Surface band{cylinder(32, false).vertices(), {}};
  for (int k = 0; k < 32; ++k) {
    const int a = 2 * k, b = 2 * ((k + 1) % 32);
    band.elements.push_back({a, b, b + 1, a + 1});
  }
  ShellOptions sharp;
  sharp.crease_angle = 0;
  CHECK_NEAR(depth(Shell(band, sharp), Method::Smooth), 0.05 - flat, 1e-12);
}

void threads_may_share_a_shell() {
  const Shell shell = cylinder(64, false);
  std::vector<double> depth(4);
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i)
    threads.emplace_back([&, i] {
      Query query;
      for (int k = 0; k < 100; ++k)
        depth[i] = query.contacts(shell, {1.05, 0.01, 0.2}, 0.1).at(0).depth;
    });
  for (std::thread& thread : threads) thread.join();
  for (const double one : depth) CHECK(one == depth[0]);
}

void a_soup_is_welded() {
  Surface soup;
  const Surface solid = cube();
  for (const Element& e : solid.elements) {
    const int corners[6] = {e.first, e.second, e.third, e.first, e.third, e.fourth};
    for (const int c : corners) soup.vertices.push_back(solid.vertices[c]);
    const int n = static_cast<int>(soup.vertices.size());
    soup.elements.push_back({n - 6, n - 5, n - 4});
    soup.elements.push_back({n - 3, n - 2, n - 1});
  }
  soup.elements.push_back({0, 0, 1});
  const Surface welded = weld(soup);
  CHECK(welded.vertices.size() == 8 && welded.elements.size() == 12);
  Query query;
  CHECK(query.contacts(Shell(welded), {0.3, 1.1, 1.1}, 0.2).size() == 1);
  // A quad whose two corners are merged is a triangle.
  const Surface tip = weld({{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {1, 1, 0}}, {{0, 1, 2, 3}}});
  CHECK(tip.elements.size() == 1 && tip.elements[0].fourth == -1);
  CHECK_THROWS(InvalidShell, "no element of the surface has an area", weld(solid, 10));
  CHECK_THROWS(InvalidShell, "element 0 uses vertex 8", weld({solid.vertices, {{0, 1, 8}}}));
  CHECK_THROWS(InvalidParameter, "tolerance = -1 must not be negative [m]", weld(solid, -1));
  CHECK_THROWS(InvalidParameter, "tolerance = nan", weld(solid, kNan));
}

void bad_input_is_refused() {
  using E = InvalidShell;
  const Points p = cube().vertices;
  const std::vector<Element> one = {{0, 1, 2}};
  CHECK_THROWS(E, "at least 3 vertices; 0 given", Shell({}, one));
  CHECK_THROWS(E, "at least one element", Shell(p, {}));
  CHECK_THROWS(E, "element 1 uses vertex 8, but the 8 vertices are numbered 0 to 7",
               Shell(p, {{0, 1, 2}, {0, 1, 8}}));
  CHECK_THROWS(E, "element 0 uses vertex -1", Shell(p, {{0, -1, 2}}));
  CHECK_THROWS(E, "element 0 uses vertex -2", Shell(p, {{0, 1, 2, -2}}));
  CHECK_THROWS(E, "element 0 has no area", Shell(p, {{0, 0, 1}}));
  CHECK_THROWS(E, "element 0 has no area in one of its halves", Shell(p, {{0, 1, 3, 3}}));
  CHECK_THROWS(E, "element 0 has no area", Shell({{0, 0, 0}, {1, 1, 1}, {2, 2, 2}}, one));
  Points bad = p;
  bad[3] = {0, kNan, 1};
  CHECK_THROWS(E, "vertex 3 is not finite: [0, nan, 1]", Shell(bad, one));
  CHECK_THROWS(E, "choose another unit", Shell({{0, 0, 0}, {1e-20, 0, 0}, {0, 1e-20, 0}}, one));
  CHECK_THROWS(E, "choose another unit", Shell({{0, 0, 0}, {1e30, 0, 0}, {0, 1e30, 0}}, one));
  ShellOptions options;
  options.normals = {{0, 0, 1}};
  CHECK_THROWS(E, "normals must be one per vertex: 1 given for 8 vertices", Shell(p, one, options));
  options.normals.assign(8, {0, 0, kNan});
  CHECK_THROWS(E, "normal 0 is not finite", Shell(p, one, options));
  options.normals.assign(8, {0, 0, 0});  // unknown: those of the elements
  CHECK(Shell(p, one, options).num_elements() == 1);
  options.crease_angle = -1;
  CHECK_THROWS(InvalidParameter, "crease_angle = -1 must lie between", Shell(p, one, options));
  options.crease_angle = kNan;
  CHECK_THROWS(InvalidParameter, "crease_angle = nan", Shell(p, one, options));
  options = {};
  options.side = static_cast<Side>(7);
  CHECK_THROWS(InvalidParameter, "side = 7", Shell(p, one, options));

  const Shell shell(cube());
  Query query;
  const auto contacts = [&](const Vector3d& center, double radius) {
    query.contacts(shell, center, radius);
  };
  CHECK_THROWS(InvalidParameter, "center = [nan, 0, 0] must be finite", contacts({kNan, 0, 0}, 1));
  CHECK_THROWS(InvalidParameter, "radius = 0 must be positive [m]", contacts({0, 0, 0}, 0));
  CHECK_THROWS(InvalidParameter, "radius = -1", contacts({0, 0, 0}, -1));
  CHECK_THROWS(InvalidParameter, "method = 5",
               query.contacts(shell, {}, 1, static_cast<Method>(5)));
  CHECK_THROWS(InvalidParameter, "point = [0, 0, inf]",
               query.closest_point(shell, {0, 0, std::numeric_limits<double>::infinity()}));
}

// What nobody means, but files hold: it is taken, and no query crashes.
void odd_surfaces_are_taken() {
  Surface odd = cube();
  odd.vertices.push_back({5, 5, 5});     // used by none
  odd.elements.push_back({0, 2, 3, 1});  // twice
  odd.elements.push_back({1, 3, 2, 0});  // and the other way round
  odd.elements.push_back({0, 1, 7, 6});  // through the middle
  odd.elements.push_back({0, 3, 6, 5});  // warped
  Query query;
  for (const double crease : {0.0, 0.5, M_PI}) {
    for (const Side side : {Side::Both, Side::Outside, Side::Inside}) {
      ShellOptions options;
      options.crease_angle = crease, options.side = side;
      const Shell shell(odd, options);
      for (int k = 0; k < 200; ++k) {
        const Vector3d center = 1.5 * Vector3d::Random();
        for (const Method method : {Method::Facets, Method::Elements, Method::Smooth}) {
          for (const Contact& c : query.contacts(shell, center, 0.5, method)) {
            CHECK(std::isfinite(c.depth) && c.element >= 0 && c.element < shell.num_elements());
            CHECK(c.point.allFinite() && std::abs(c.normal.norm() - 1) < 1e-9);
          }
        }
      }
    }
  }
}

}  // namespace

void a_shell_that_was_moved_stays_one() {
  Shell first(Points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}});
  const Shell second = std::move(first);
  CHECK(first.num_elements() == 1 && second.num_elements() == 1);
}

int main() {
  a_shell_that_was_moved_stays_one();
  a_cube_is_touched_on_faces_edges_and_corners();
  curved_elements_follow_the_true_surface();
  threads_may_share_a_shell();
  a_soup_is_welded();
  bad_input_is_refused();
  odd_surfaces_are_taken();
}
