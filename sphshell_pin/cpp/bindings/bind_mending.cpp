// Python face of the surface cleaning loops. Arrays go in as they are, come out as new arrays.
#include <nanobind/stl/optional.h>

#include <optional>

#include "bindings/arrays.hpp"
#include "bindings/gil.hpp"
#include "shell/cleaning/mending.hpp"

namespace sphshell {
namespace {

template <typename T>
using In = nb::ndarray<const T, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
template <typename T, int Columns>
using InRows = nb::ndarray<const T, nb::shape<-1, Columns>, nb::c_contig, nb::device::cpu>;

// A list of numbers as an array of that many columns.
template <std::size_t Columns, typename T>
Array<T> rows_of(std::vector<T> values) {
  const std::size_t rows = values.size() / Columns;
  return to_array(std::move(values), {rows, Columns});
}

// For loops over plain memory, which may take seconds.
template <typename Loop>
auto without_gil(Loop&& loop) {
  const ReleaseGil released;
  return loop();
}

PolygonView view(const In<std::int64_t>& offsets, const In<std::int32_t>& corners) {
  return {offsets.data(), corners.data(), offsets.shape(0) - 1};
}

template <typename T>
std::vector<T> copy(const In<T>& values) {
  return {values.data(), values.data() + values.shape(0)};
}

}  // namespace
}  // namespace sphshell

void bind_mending(nanobind::module_& module) {
  using namespace sphshell;

  // Each takes and returns arrays; what they mean is in mending.hpp.
  module.def(
      "mend_weld",
      [](InRows<double, 3> points, double tolerance) {
        auto result = without_gil([&] { return weld(points.data(), points.shape(0), tolerance); });
        return nb::make_tuple(to_array(std::move(result.representative)), result.largest_distance);
      },
      "points"_a, "tolerance"_a,
      "(representative (n,), largest distance [m]) of points (n,3) merged transitively.");

  module.def(
      "mend_edges",
      [](In<std::int64_t> offsets, In<std::int32_t> corners, std::size_t vertex_count) {
        auto table = without_gil([&] { return edge_table(view(offsets, corners), vertex_count); });
        return nb::make_tuple(to_array(std::move(table.slot_edge)),
                              rows_of<2>(std::move(table.ends)), to_array(std::move(table.users)));
      },
      "offsets"_a, "corners"_a, "vertex_count"_a,
      "(edge of each slot, ends (E,2), users (E,)) of polygons.");

  module.def(
      "mend_duplicates",
      [](In<std::int64_t> offsets, In<std::int32_t> corners, In<std::int32_t> slot_edge,
         In<std::int32_t> users) {
        auto result = without_gil([&] {
          return duplicate_polygons(view(offsets, corners), slot_edge.data(), users.data(),
                                    users.shape(0));
        });
        return to_arrays(std::move(result.first), std::move(result.opposite));
      },
      "offsets"_a, "corners"_a, "slot_edge"_a, "users"_a,
      "(first polygon with the same corners (m,), wound the other way (m,)).");

  module.def(
      "mend_repeats",
      [](In<std::int64_t> offsets, In<std::int32_t> corners) {
        return to_array(repeated_corners(view(offsets, corners)));
      },
      "offsets"_a, "corners"_a, "Which corners (c,) repeat the next one; empty if none does.");

  module.def(
      "mend_shapes",
      [](In<std::int64_t> offsets, In<std::int32_t> corners, InRows<double, 3> points) {
        return to_array(triangle_shapes(view(offsets, corners), points.data()));
      },
      "offsets"_a, "corners"_a, "points"_a,
      "2 area / longest edge^2 (m,) of triangles; -1 of polygons with more corners.");

  module.def(
      "mend_sums",
      [](InRows<double, 3> points, InRows<std::int32_t, 3> triangles,
         std::optional<In<std::int32_t>> polygon, In<std::int32_t> component, In<std::uint8_t> flip,
         std::size_t components, In<double> center) {
        auto sums = without_gil([&] {
          return component_sums(points.data(), triangles.data(),
                                polygon ? polygon->data() : nullptr, triangles.shape(0),
                                component.data(), flip.data(), components, center.data());
        });
        return to_arrays(std::move(sums.volume), std::move(sums.area), std::move(sums.turned_area));
      },
      "points"_a, "triangles"_a, "triangle_polygon"_a.none(), "component"_a, "flip"_a,
      "components"_a, "center"_a, "(volume, area, turned area) of each component.");

  module.def(
      "mend_clip_ears",
      [](In<std::int64_t> offsets, In<std::int32_t> corners, InRows<double, 3> points,
         double tolerance) {
        auto result = without_gil(
            [&] { return clip_ears(view(offsets, corners), points.data(), tolerance); });
        return nb::make_tuple(rows_of<3>(std::move(result.triangle_slots)),
                              to_array(std::move(result.triangle_polygon)),
                              to_array(std::move(result.tangled)));
      },
      "offsets"_a, "corners"_a, "points"_a, "tolerance"_a,
      "(slots of the triangles (t,3), their polygon (t,), tangled (m,)).");

  module.def(
      "mend_t_junctions",
      [](In<std::int64_t> offsets, In<std::int32_t> corners, InRows<double, 3> points,
         In<std::int64_t> open_slots, In<std::int32_t> open_polygons, In<std::int32_t> candidates,
         double tolerance, std::size_t most) {
        auto result = without_gil([&] {
          return find_t_junctions(view(offsets, corners), points.data(), copy(open_slots),
                                  copy(open_polygons), copy(candidates), tolerance, most);
        });
        return to_arrays(std::move(result.slot), std::move(result.vertex),
                         std::move(result.parameter));
      },
      "offsets"_a, "corners"_a, "points"_a, "open_slots"_a, "open_polygons"_a, "candidates"_a,
      "tolerance"_a, "most"_a,
      "(slot, vertex, parameter) of vertices inside open edges, in order along them; one more than "
      "`most` where there are more.");

  module.def(
      "mend_flood_fill",
      [](In<std::int64_t> offsets, In<std::int32_t> corners, In<std::int32_t> slot_edge,
         In<std::int32_t> users) {
        auto result = without_gil([&] {
          return flood_fill(view(offsets, corners), slot_edge.data(), users.data(), users.shape(0));
        });
        return to_arrays(std::move(result.component), std::move(result.flip),
                         std::move(result.one_sided));
      },
      "offsets"_a, "corners"_a, "slot_edge"_a, "users"_a,
      "(component (m,), flip (m,), one-sided (components,)) across edges of two polygons.");

  module.def(
      "mend_components",
      [](std::size_t nodes, InRows<std::int32_t, 2> pairs) {
        return to_array(connected_components(nodes, pairs.data(), pairs.shape(0)));
      },
      "nodes"_a, "pairs"_a, "Component (nodes,) of an undirected graph.");

  module.def(
      "mend_overlaps",
      [](InRows<double, 3> points, InRows<std::int32_t, 3> triangles,
         In<std::int32_t> triangle_component, InRows<double, 3> places,
         In<std::int32_t> place_component, In<std::int32_t> group) {
        auto found = without_gil([&] {
          return overlaps(points.data(), triangles.data(), triangle_component.data(),
                          triangles.shape(0), places.data(), place_component.data(),
                          places.shape(0), group.data());
        });
        return nb::make_tuple(rows_of<2>(std::move(found.pairs)), to_array(std::move(found.share)));
      },
      "points"_a, "triangles"_a, "triangle_component"_a, "places"_a, "place_component"_a, "group"_a,
      "(component and another (p,2), share (p,) of the first's inside that is in the other), along "
      "lines through places (n,3).");
}
