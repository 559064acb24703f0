#include "bindings/arrays.hpp"
#include "contact/laws/foundation.hpp"

#include <nanobind/eigen/dense.h>
#include <nanobind/stl/tuple.h>

namespace sphshell {
namespace {

// Of the rows: patch, element, depth, center, force, energy, slope; of the points: point, normal,
// area, pressure, force, row.
nb::tuple columns(const Foundation& foundation) {
  const auto& rows = foundation.rows();
  const auto& points = foundation.points();
  std::vector<int> patch, element, number;
  std::vector<double> depth, center, force, energy, slope, point, normal, area, pressure, push;
  // Column by column, as Python's structured results have them.
  for (const FoundationRow& row : rows) {
    patch.push_back(row.patch), element.push_back(row.element);
    depth.push_back(row.depth), energy.push_back(row.sum.energy);
    append(center, row.center), append(force, row.sum.force);
    for (int i = 0; i < 3; ++i) append(slope, row.sum.slope.row(i));
  }
  for (const FoundationPoint& one : points) {
    append(point, one.point), append(normal, one.normal), append(push, one.force);
    area.push_back(one.area), pressure.push_back(one.pressure), number.push_back(one.row);
  }
  const std::size_t k = rows.size(), n = points.size();
  return nb::make_tuple(
      nb::make_tuple(to_array(std::move(patch)), to_array(std::move(element)),
                     to_array(std::move(depth)), to_array(std::move(center), {k, 3}),
                     to_array(std::move(force), {k, 3}), to_array(std::move(energy)),
                     to_array(std::move(slope), {k, 3, 3})),
      nb::make_tuple(to_array(std::move(point), {n, 3}), to_array(std::move(normal), {n, 3}),
                     to_array(std::move(area)), to_array(std::move(pressure)),
                     to_array(std::move(push), {n, 3}), to_array(std::move(number))));
}

}  // namespace
}  // namespace sphshell

void bind_foundation(nanobind::module_& m) {
  using namespace sphshell;
  // For pictures and tests of the pressure: scenes have foundations of their own.
  nb::class_<Foundation>(m, "Foundation")
      .def(nb::init<>())
      .def(
          "find",
          [](Foundation& self, const Shell& shell, const Vec3& center, double radius, int method,
             bool points) {
            self.find(shell, static_cast<Method>(method), center, radius, true, points);
            return columns(self);
          },
          "shell"_a, "center"_a, "radius"_a, "method"_a, "points"_a = false)
      .def(
          "find_on_ball",
          [](Foundation& self, double ball, const Vec3& center, double radius, bool points) {
            self.find_on_ball(ball, center, radius, points);
            return columns(self);
          },
          "ball"_a, "center"_a, "radius"_a, "points"_a = false);
}
