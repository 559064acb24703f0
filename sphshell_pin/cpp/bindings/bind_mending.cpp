// Python face of the surface cleaning loops, by position. Arrays go in as they are, come out as new
// arrays; what they mean is in mending.hpp.
#include "bindings/arrays.hpp"
#include "bindings/gil.hpp"
#include "shell/cleaning/mending.hpp"

using namespace sphshell;

namespace {

template <class Row>
auto arrays(std::vector<Row> rows) {
  return to_array(std::move(rows));
}
nb::tuple arrays(Weld found) {
  return nb::make_tuple(to_array(std::move(found.representative)), found.largest_distance);
}
nb::tuple arrays(EdgeTable found) { return to_arrays(found.slot_edge, found.ends, found.users); }
nb::tuple arrays(Duplicates found) { return to_arrays(found.first, found.opposite); }
nb::tuple arrays(ComponentSums found) {
  return to_arrays(found.volume, found.area, found.turned_area);
}
nb::tuple arrays(EarClips found) {
  return to_arrays(found.triangle_slots, found.triangle_polygon, found.tangled);
}
nb::tuple arrays(Insertions found) { return to_arrays(found.slot, found.vertex, found.parameter); }
nb::tuple arrays(Orientation found) {
  return to_arrays(found.component, found.flip, found.one_sided);
}
nb::tuple arrays(Overlaps found) { return to_arrays(found.pairs, found.share); }

// Loops over plain memory may take seconds: other threads of Python go on meanwhile.
template <class Loop, class... Args>
auto call(Loop* loop, const Args&... args) {
  auto found = [&] {
    const ReleaseGil released;
    return loop(args...);
  }();
  return arrays(std::move(found));
}

template <class Found, class... Args>
auto bound(Found (*loop)(Args...)) {
  return [=](Args... args) { return call(loop, args...); };
}

// Polygons come as two arrays.
template <class Found, class... Args>
auto bound(Found (*loop)(const PolygonView&, Args...)) {
  return [=](Rows<std::int64_t> offsets, Indices corners, Args... args) {
    return call(loop, PolygonView{offsets.data, corners.data, offsets.count - 1}, args...);
  };
}

}  // namespace

void bind_mending(nb::module_& m) {
  m.def("mend_weld", bound(&weld));
  m.def("mend_edges", bound(&edge_table));
  m.def("mend_duplicates", bound(&duplicate_polygons));
  m.def("mend_repeats", bound(&repeated_corners));
  m.def("mend_shapes", bound(&triangle_shapes));
  m.def("mend_sums", bound(&component_sums));
  m.def("mend_clip_ears", bound(&clip_ears));
  m.def("mend_t_junctions", bound(&find_t_junctions));
  m.def("mend_flood_fill", bound(&flood_fill));
  m.def("mend_components", bound(&connected_components));
  m.def("mend_overlaps", bound(&overlaps));
}
