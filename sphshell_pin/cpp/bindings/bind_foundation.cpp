#include "bindings/arrays.hpp"
#include "contact/laws/foundation.hpp"

#include <nanobind/eigen/dense.h>
#include <nanobind/stl/tuple.h>

using namespace sphshell;

// Of the rows: patch, element, depth, center, force, energy, slope; of the points: point, normal,
// area, pressure, force, row.
static nb::tuple columns(const Foundation& foundation) {
  using Row = FoundationRow;
  using Point = FoundationPoint;
  using Slope = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  const std::vector<Row>& rows = foundation.rows();
  auto slopes = column(rows, [](const Row& row) -> Slope { return row.sum.slope; });
  return nb::make_tuple(
      columns(
          rows, &Row::patch, &Row::element, &Row::depth, &Row::center,
          [](const Row& row) { return row.sum.force; },
          [](const Row& row) { return row.sum.energy; }) +
          nb::make_tuple(array_of<double>(std::move(slopes), {rows.size(), 3, 3})),
      columns(foundation.points(), &Point::point, &Point::normal, &Point::area, &Point::pressure,
              &Point::force, &Point::row));
}

void bind_foundation(nb::module_& m) {
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
