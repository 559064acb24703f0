// Python face of the surface cleaning loops. Arrays go in as they are, come out as new arrays.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>

#include <optional>
#include <utility>
#include <vector>

#include "bindings/gil.hpp"
#include "shell/mending.hpp"

namespace nb = nanobind;

namespace {

template <typename T>
using In = nb::ndarray<const T, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
template <typename T, int Columns>
using InRows = nb::ndarray<const T, nb::shape<-1, Columns>, nb::c_contig, nb::device::cpu>;

// Hands a vector over to NumPy without copying; rows of `columns` if that is not 0.
template <typename T>
nb::object give(std::vector<T>&& values, std::size_t columns = 0) {
  auto* kept = new std::vector<T>(std::move(values));
  nb::capsule owner(kept, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
  const std::size_t size = kept->size();
  // NumPy wants an address even for nothing.
  static T nothing{};
  T* data = size > 0 ? kept->data() : &nothing;
  if (columns == 0) return nb::cast(nb::ndarray<nb::numpy, T>(data, {size}, owner));
  return nb::cast(nb::ndarray<nb::numpy, T>(data, {size / columns, columns}, owner));
}

sphshell::PolygonView view(const In<std::int64_t>& offsets, const In<std::int32_t>& corners) {
  return {offsets.data(), corners.data(), offsets.shape(0) - 1};
}

template <typename T>
std::vector<T> copy(const In<T>& values) {
  return {values.data(), values.data() + values.shape(0)};
}

}  // namespace

void bind_mending(nb::module_& module) {
  using namespace nb::literals;

  module.def(
      "mend_weld",
      [](InRows<double, 3> points, double tolerance) {
        sphshell::Weld result;
        {
          const sphshell::ReleaseGil released;
          result = sphshell::weld(points.data(), points.shape(0), tolerance);
        }
        return nb::make_tuple(give(std::move(result.representative)), result.largest_distance);
      },
      "points"_a, "tolerance"_a,
      "(representative (n,), largest distance [m]) of points (n,3) merged transitively.");

  module.def(
      "mend_edges",
      [](In<std::int64_t> offsets, In<std::int32_t> corners, std::size_t vertex_count) {
        sphshell::EdgeTable table;
        {
          const sphshell::ReleaseGil released;
          table = sphshell::edge_table(view(offsets, corners), vertex_count);
        }
        return nb::make_tuple(give(std::move(table.slot_edge)), give(std::move(table.ends), 2),
                              give(std::move(table.users)));
      },
      "offsets"_a, "corners"_a, "vertex_count"_a,
      "(edge of each slot, ends (E,2), users (E,)) of polygons.");

  module.def(
      "mend_duplicates",
      [](In<std::int64_t> offsets, In<std::int32_t> corners, In<std::int32_t> slot_edge,
         In<std::int32_t> users) {
        sphshell::Duplicates result;
        {
          const sphshell::ReleaseGil released;
          result = sphshell::duplicate_polygons(view(offsets, corners), slot_edge.data(),
                                                users.data(), users.shape(0));
        }
        return nb::make_tuple(give(std::move(result.first)), give(std::move(result.opposite)));
      },
      "offsets"_a, "corners"_a, "slot_edge"_a, "users"_a,
      "(first polygon with the same corners (m,), wound the other way (m,)).");

  module.def(
      "mend_repeats",
      [](In<std::int64_t> offsets, In<std::int32_t> corners) {
        return give(sphshell::repeated_corners(view(offsets, corners)));
      },
      "offsets"_a, "corners"_a, "Which corners (c,) repeat the next one; empty if none does.");

  module.def(
      "mend_shapes",
      [](In<std::int64_t> offsets, In<std::int32_t> corners, InRows<double, 3> points) {
        return give(sphshell::triangle_shapes(view(offsets, corners), points.data()));
      },
      "offsets"_a, "corners"_a, "points"_a,
      "2 area / longest edge^2 (m,) of triangles; -1 of polygons with more corners.");

  module.def(
      "mend_sums",
      [](InRows<double, 3> points, InRows<std::int32_t, 3> triangles,
         std::optional<In<std::int32_t>> polygon, In<std::int32_t> component, In<std::uint8_t> flip,
         std::size_t components, In<double> centre) {
        sphshell::ComponentSums sums;
        {
          const sphshell::ReleaseGil released;
          sums = sphshell::component_sums(points.data(), triangles.data(),
                                          polygon ? polygon->data() : nullptr, triangles.shape(0),
                                          component.data(), flip.data(), components, centre.data());
        }
        return nb::make_tuple(give(std::move(sums.volume)), give(std::move(sums.area)),
                              give(std::move(sums.turned_area)), give(std::move(sums.largest)));
      },
      "points"_a, "triangles"_a, "triangle_polygon"_a.none(), "component"_a, "flip"_a,
      "components"_a, "centre"_a,
      "(volume, area, turned area, largest triangle) of each component.");

  module.def(
      "mend_clip_ears",
      [](In<std::int64_t> offsets, In<std::int32_t> corners, InRows<double, 3> points,
         double tolerance) {
        sphshell::EarClips result;
        {
          const sphshell::ReleaseGil released;
          result = sphshell::clip_ears(view(offsets, corners), points.data(), tolerance);
        }
        return nb::make_tuple(give(std::move(result.triangle_slots), 3),
                              give(std::move(result.triangle_polygon)),
                              give(std::move(result.tangled)));
      },
      "offsets"_a, "corners"_a, "points"_a, "tolerance"_a,
      "(slots of the triangles (t,3), their polygon (t,), tangled (m,)).");

  module.def(
      "mend_t_junctions",
      [](In<std::int64_t> offsets, In<std::int32_t> corners, InRows<double, 3> points,
         In<std::int64_t> open_slots, In<std::int32_t> open_polygons, In<std::int32_t> candidates,
         double tolerance, std::size_t most) {
        sphshell::Insertions result;
        {
          const sphshell::ReleaseGil released;
          result =
              sphshell::find_t_junctions(view(offsets, corners), points.data(), copy(open_slots),
                                         copy(open_polygons), copy(candidates), tolerance, most);
        }
        return nb::make_tuple(give(std::move(result.slot)), give(std::move(result.vertex)),
                              give(std::move(result.parameter)));
      },
      "offsets"_a, "corners"_a, "points"_a, "open_slots"_a, "open_polygons"_a, "candidates"_a,
      "tolerance"_a, "most"_a,
      "(slot, vertex, parameter) of vertices inside open edges, in order along them; one more than "
      "`most` where there are more.");

  module.def(
      "mend_flood_fill",
      [](In<std::int64_t> offsets, In<std::int32_t> corners, In<std::int32_t> slot_edge,
         In<std::int32_t> users) {
        sphshell::Orientation result;
        {
          const sphshell::ReleaseGil released;
          result = sphshell::flood_fill(view(offsets, corners), slot_edge.data(), users.data(),
                                        users.shape(0));
        }
        return nb::make_tuple(give(std::move(result.component)), give(std::move(result.flip)),
                              give(std::move(result.one_sided)));
      },
      "offsets"_a, "corners"_a, "slot_edge"_a, "users"_a,
      "(component (m,), flip (m,), one-sided (components,)) across edges of two polygons.");

  module.def(
      "mend_components",
      [](std::size_t nodes, InRows<std::int32_t, 2> pairs) {
        return give(sphshell::connected_components(nodes, pairs.data(), pairs.shape(0)));
      },
      "nodes"_a, "pairs"_a, "Component (nodes,) of an undirected graph.");

  module.def(
      "mend_nesting",
      [](InRows<double, 3> points, InRows<std::int32_t, 3> triangles,
         In<std::int32_t> triangle_component, InRows<double, 3> queries, In<std::uint8_t> closed) {
        std::vector<std::int32_t> depth;
        {
          const sphshell::ReleaseGil released;
          depth = sphshell::nesting_depth(points.data(), triangles.data(),
                                          triangle_component.data(), triangles.shape(0),
                                          queries.data(), closed.data(), closed.shape(0));
        }
        return give(std::move(depth));
      },
      "points"_a, "triangles"_a, "triangle_component"_a, "queries"_a, "closed"_a,
      "How many closed components enclose the query point (c,3) of each component.");
}
