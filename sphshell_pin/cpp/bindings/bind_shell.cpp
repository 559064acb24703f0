#include "bindings/gil.hpp"
#include "bindings/records.hpp"
#include "shell/in_parallel.hpp"

#include <nanobind/eigen/dense.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/tuple.h>

using namespace sphshell;

namespace {

// Copied as a block: three doubles are a Vec3, three integers a triangle.
template <class Row, class T, int... columns>
std::vector<Row> copied(const Rows<T, columns...>& table) {
  static_assert(sizeof(Row) == (sizeof(T) * ... * columns));
  const auto* first = reinterpret_cast<const Row*>(table.data);
  return {first, first + table.count};
}
template <class Row, class Array>
std::vector<Row> copied(const std::optional<Array>& table) {
  if (!table) return {};
  const auto* first = reinterpret_cast<const Row*>(table->data());
  return {first, first + table->shape(0)};
}

// Arrays were checked in Python: triangles (m, 3), the element of each, and of CAD the face and
// three normals of each.
std::shared_ptr<Shell> make_shell(const Points& vertices, const Rows<int, 3>& triangles,
                                  const Indices& element, double crease_angle, int side,
                                  const std::optional<InArray<int>>& face,
                                  const std::optional<InArray<double, 3>>& normals) {
  std::vector<Vec3> points = copied<Vec3>(vertices);
  std::vector<Triangle> corners = copied<Triangle>(triangles);
  std::vector<int> owner = copied<int>(element);
  const CadFaces cad{copied<int>(face), copied<Vec3>(normals)};
  const ReleaseGil released;
  return std::make_shared<Shell>(std::move(points), std::move(corners), std::move(owner),
                                 crease_angle, static_cast<Side>(side), cad);
}

// A contact as Python reads it; dn_dc is zero unless it was asked for.
struct ShellContactRow {
  double point[3], normal[3], depth, weight, turn[9];
  std::int32_t element;
  Feature feature;
};

constexpr RowField kShellContactFields[] = {
    {"point", "f8", 3, offsetof(ShellContactRow, point)},
    {"normal", "f8", 3, offsetof(ShellContactRow, normal)},
    {"depth", "f8", 1, offsetof(ShellContactRow, depth)},
    {"element", "i4", 1, offsetof(ShellContactRow, element)},
    {"feature", "u1", 1, offsetof(ShellContactRow, feature)},
    {"weight", "f8", 1, offsetof(ShellContactRow, weight)},
    {"turn", "f8", 9, offsetof(ShellContactRow, turn)},
};

nb::bytes contact_rows(const std::vector<Contact>& contacts, bool dn_dc) {
  std::vector<ShellContactRow> rows(contacts.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Contact& c = contacts[i];
    ShellContactRow& row = rows[i];
    Eigen::Map<Vec3>(row.point) = c.point;
    Eigen::Map<Vec3>(row.normal) = c.normal;
    row.depth = c.depth;
    row.weight = c.weight;
    for (int k = 0; dn_dc && k < 3; ++k) Eigen::Map<Vec3>(row.turn + 3 * k) = c.dn_dc.row(k);
    row.element = c.element;
    row.feature = c.feature;
  }
  return nb::bytes(rows.data(), rows.size() * sizeof(ShellContactRow));
}

// The Python face has made the curved elements before it asks for them.
Method checked_method(const Shell& shell, int number) {
  const auto method = static_cast<Method>(number);
  if (number < 0 || number > 2 || (method == Method::Smooth && !shell.curved()))
    raise_own("InvalidParameter", "method", number, "must be 0, 1, or after curve() 2");
  return method;
}

using Place = nb::ndarray<const double, nb::shape<3>, nb::device::cpu>;

// The contacts as shown, and those that are summed, where these are more.
nb::tuple contacts(const Shell& shell, const Place& at, double radius, int method, bool dn_dc) {
  const Vec3 center(at(0), at(1), at(2));
  const Method how = checked_method(shell, method);
  Query query;
  if (dn_dc) query.want_dn_dc();
  std::vector<Contact> shown;
  merge_groups(query.find(shell, center, radius, how), center, radius, shown);
  const bool same = shown.size() == query.contacts.size();
  return nb::make_tuple(contact_rows(shown, dn_dc),
                        same ? nb::object(nb::none()) : contact_rows(query.contacts, dn_dc));
}

constexpr std::size_t kGrain = 64;  // fewer queries are not worth a thread

// Depth of the deepest contact and number of minima, of each sphere. Each thread has scratch of its
// own.
auto contacts_batch(const Shell& shell, const Points& centers, const Rows<double>& radii,
                    int method, int threads) {
  const std::size_t n = centers.count;
  check_count("radii", radii.count, n);
  const Method how = checked_method(shell, method);
  std::vector<double> depth(n, 0.0);
  std::vector<int> count(n, 0);
  {
    const ReleaseGil released;
    in_parallel(n, threads, kGrain, [&](std::size_t begin, std::size_t end) {
      Query query;
      std::vector<Contact> shown;
      for (std::size_t i = begin; i < end; ++i) {
        const Vec3 center = place(centers, i);
        merge_groups(query.find(shell, center, radii[i], how), center, radii[i], shown);
        for (const Contact& c : shown)
          depth[i] = std::max(depth[i], c.depth), count[i] += c.weight > 0;
      }
    });
  }
  return to_arrays(depth, count);
}

// Points, normals, signed distances and elements.
auto closest_points(const Shell& shell, const Points& points, bool smooth, int threads) {
  if (smooth) checked_method(shell, static_cast<int>(Method::Smooth));
  std::vector<SurfacePoint> found(points.count);
  {
    const ReleaseGil released;
    in_parallel(found.size(), threads, kGrain, [&](std::size_t begin, std::size_t end) {
      Query query;
      for (std::size_t i = begin; i < end; ++i) {
        found[i] = shell.closest_point(place(points, i));
        if (smooth) found[i] = on_curved(shell, place(points, i), found[i], query);
      }
    });
  }
  return columns(found, &SurfacePoint::point, &SurfacePoint::normal, &SurfacePoint::distance,
                 &SurfacePoint::element);
}

// An array over the shell's own memory, which lives as long as the array.
template <class T, class Row>
auto view(nb::handle shell, const std::vector<Row>& rows) {
  const auto* first = reinterpret_cast<const T*>(rows.data());
  if constexpr (sizeof(Row) == sizeof(T))
    return nb::ndarray<nb::numpy, const T>(first, {rows.size()}, shell);
  else
    return nb::ndarray<nb::numpy, const T>(first, {rows.size(), sizeof(Row) / sizeof(T)}, shell);
}

// get(edge) for every edge between elements.
template <class Get>
auto per_edge(const Shell& shell, Get&& get) {
  std::vector<std::invoke_result_t<Get, const Edge&>> out;
  for (const Edge& edge : shell.topology().edges)
    if (!edge.inner) out.push_back(get(edge));
  return to_array(std::move(out));
}

// Triangles with curved elements; none before these are made.
std::size_t count_curved(const Shell& shell) {
  return shell.curved() ? shell.triangles().size() : 0;
}

// Per triangle: offsets of the two control points of each side, and of the center.
Array<double> control_point_offsets(const Shell& shell) {
  const std::size_t n = count_curved(shell);
  std::vector<std::array<Vec3, 7>> out(n);
  for (std::size_t f = 0; f < n; ++f) {
    const CurvedFacet& curved = shell.curved()->facets()[f];
    std::array<Vec3, 7>& to = out[std::size_t(shell.triangle_of_facet(int(f)))];
    for (int k = 0; k < 6; ++k) to[k] = curved.control_offset(k / 2, k % 2);
    to[6] = curved.middle(shell.facets()[f]);
  }
  return array_of<double>(std::move(out), {n, 7, 3});
}

// The normals of the curved elements at their corners.
Array<double> corner_normals(const Shell& shell) {
  const std::size_t n = count_curved(shell);
  std::vector<Vec3> out;
  for (std::size_t t = 0; t < n; ++t) {
    const int f = triangle_of(shell.facet_half_edge(static_cast<int>(3 * t)));
    const CubicPatch patch = shell.curved()->facets()[f].patch(shell.facets()[f]);
    for (const auto& [u, v] : {std::pair(0, 0), {1, 0}, {0, 1}})
      out.push_back(patch.along_u(u, v).cross(patch.along_v(u, v)).normalized());
  }
  return array_of<double>(std::move(out), {n, 3, 3});
}

// Per triangle, see Bending; empty without curved elements.
Array<std::uint8_t> bending(const Shell& shell) {
  std::vector<std::uint8_t> out(count_curved(shell));
  for (std::size_t t = 0; t < out.size(); ++t)
    out[t] = static_cast<std::uint8_t>(shell.curved()->bending(shell, static_cast<int>(t)));
  return to_array(std::move(out));
}

// Rows of kind, point, axis and the two radii, as CleanedSurface.face_shapes in Python has them.
using FaceShapes = InArray<double, 9>;

// A face of no known kind has a negative one: its triangles lie on no face then, and its number
// stays taken.
std::shared_ptr<const Faces> known_faces(const InArray<int>& of, const FaceShapes& shapes) {
  auto out = std::make_shared<Faces>();
  for (std::size_t i = 0; i < shapes.shape(0); ++i) {
    const auto vector = [&](int k) {
      return Vec3(shapes(i, k), shapes(i, k + 1), shapes(i, k + 2));
    };
    const int kind = std::max(0, static_cast<int>(shapes(i, 0)));
    out->shapes.push_back(
        {static_cast<FaceKind>(kind), vector(1), vector(4), shapes(i, 7), shapes(i, 8)});
  }
  for (std::size_t t = 0; t < of.shape(0); ++t)
    out->of.push_back(of(t) >= 0 && shapes(of(t), 0) >= 0 ? of(t) : -1);
  return out;
}

// Per triangle the face it lies on, -1: none; and of each face its kind and numbers (8): a point,
// the axis, the two radii.
Array<int> triangle_face(const Shell& shell) {
  std::vector<int> out;
  if (shell.curved()) out = shell.curved()->faces().of;
  out.resize(count_curved(shell), -1);
  return to_array(std::move(out));
}

// Per triangle whether the face it lies on gives its closest points.
Array<std::uint8_t> exact_triangles(const Shell& shell) {
  std::vector<std::uint8_t> out;
  if (const CurvedShell* surface = shell.curved()) {
    const Faces& faces = surface->faces();
    // Where no face has to, all are flat or none gives anything.
    for (const int face : faces.of)
      out.push_back(face >= 0 && faces.shapes[face].kind == FaceKind::Plane);
    out.resize(shell.triangles().size(), 0);
    for (std::size_t f = 0; f < surface->face_cells().size(); ++f)
      out[shell.triangle_of_facet(static_cast<int>(f))] = surface->face_cells()[f].exact;
  }
  return to_array(std::move(out));
}

// Faces that do not give all closest points: which, beside which other one (-1: none), and how far
// off [m]; (n, 3).
Array<double> inexact_faces(const Shell& shell) {
  std::vector<std::array<double, 3>> out;
  if (shell.curved())
    for (const Inexact& one : shell.curved()->inexact())
      out.push_back({double(one.face), double(one.other), one.off});
  return to_array(std::move(out));
}

// Kinds (n,) and numbers (n, 8) of all faces.
nb::tuple faces(const Shell& shell) {
  std::vector<int> kind;
  std::vector<double> numbers;
  if (shell.curved())
    for (const Primitive& face : shell.curved()->faces().shapes) {
      kind.push_back(static_cast<int>(face.kind));
      append(numbers, face.point);
      append(numbers, face.axis);
      numbers.insert(numbers.end(), {face.radius, face.second});
    }
  return nb::make_tuple(to_array(std::move(kind)), rows_of<8>(std::move(numbers)));
}

// Per corner (n, 3), see CurvedShell::divided.
Array<std::uint8_t> normals_set_aside(const Shell& shell) {
  std::vector<std::uint8_t> out;
  if (shell.curved())
    out.assign(shell.curved()->divided().begin(), shell.curved()->divided().end());
  return rows_of<3>(std::move(out));
}

}  // namespace

void bind_shell(nb::module_& m) {
  // Behind the Shell of Python, which has read, checked and triangulated the surface.
  m.def("shell_contact_row_type", [] { return row_type<ShellContactRow>(kShellContactFields); });
  nb::class_<Shell> shell(m, "Shell");
  shell
      .def(nb::new_(&make_shell), "vertices"_a, "triangles"_a, "triangle_element"_a,
           "crease_angle"_a, "side"_a, "face"_a.none() = nb::none(),
           "normals"_a.none() = nb::none())
      .def("__reduce_ex__",
           [](const Shell&, int) -> nb::object {
             raise_own("NotPicklable",
                       "a compiled core cannot be pickled or copied: send its Shell instead");
           })
      .def(
          "curve",
          [](const std::shared_ptr<Shell>& shell, std::optional<InArray<double, 3>> normals,
             bool exact, std::optional<InArray<std::uint8_t>> straight, double rounding, bool faces,
             std::optional<InArray<int>> known, std::optional<FaceShapes> shapes) {
            CurveOptions options{copied<Vec3>(normals),
                                 exact,
                                 copied<std::uint8_t>(straight),
                                 rounding,
                                 faces,
                                 nullptr,
                                 nullptr};
            if (known && shapes) options.known = known_faces(*known, *shapes);
            // Under the GIL: two threads may ask for the first curved query at once.
            return curve(shell, std::move(options));
          },
          "normals"_a.none(), "exact"_a = false, "straight"_a.none() = nb::none(),
          "rounding"_a = 0.0, "faces"_a = true, "known"_a.none() = nb::none(),
          "shapes"_a.none() = nb::none())
      .def("contacts", &contacts, "center"_a, "radius"_a, "method"_a, "gradient"_a = false)
      .def("contacts_batch", &contacts_batch, "centers"_a, "radii"_a, "method"_a, "threads"_a)
      .def("closest_points", &closest_points, "points"_a, "smooth"_a, "threads"_a = 1)
      .def_prop_ro("num_elements", &Shell::num_elements)
      .def_prop_ro("num_patches", [](const Shell& s) { return s.topology().num_patches; })
      .def_prop_ro(
          "pinched_vertices",
          [](const Shell& s) { return to_array(column(s.topology().pinches, &Pinch::vertex)); },
          nb::rv_policy::automatic)
      .def_prop_ro("creases", [](const Shell& s) { return s.curved() ? s.curved()->creases() : 0; })
      // Of a shell with curved elements.
      .def_prop_ro("has_flats", [](const Shell& s) { return s.curved()->flats(s).any(); })
      .def_prop_ro("has_other_flats", [](const Shell& s) { return s.curved()->flats(s).others; });
  // Arrays own their memory, or keep the shell alive: no policy of nanobind's own applies.
  const auto array = [&](const char* name, auto get) {
    shell.def_prop_ro(name, get, nb::rv_policy::automatic);
  };
  const auto memory = [&](const char* name, auto number, auto rows) {
    array(name, [rows](nb::handle self) {
      return view<decltype(number)>(self, rows(nb::cast<const Shell&>(self)));
    });
  };
  memory("vertices", double(), [](const Shell& s) -> auto& { return s.vertices(); });
  memory("triangles", int(), [](const Shell& s) -> auto& { return s.triangles(); });
  memory("triangle_element", int(), [](const Shell& s) -> auto& { return s.element(); });
  memory("triangle_normals", double(),
         [](const Shell& s) -> auto& { return s.topology().face_normal; });
  array("control_point_offsets", &control_point_offsets);
  array("corner_normals", &corner_normals);
  array("bending", &bending);
  array("triangle_face", &triangle_face);
  array("exact_triangles", &exact_triangles);
  array("inexact_faces", &inexact_faces);
  array("chord_errors", [](const Shell& s) {
    return to_array(s.curved() ? s.curved()->chord_errors(s) : std::vector<double>());
  });
  shell.def_prop_ro("faces", &faces);
  array("normals_set_aside", &normals_set_aside);
  array("element_patch", [](const Shell& s) { return to_array(s.topology().patch); });
  array("edge_vertices", [](const Shell& s) {
    return per_edge(s, [](const Edge& e) { return std::array{e.first_vertex, e.last_vertex}; });
  });
  array("edge_class", [](const Shell& s) {
    return per_edge(s, [](const Edge& e) { return static_cast<std::uint8_t>(e.kind); });
  });
  array("edge_angle",
        [](const Shell& s) { return per_edge(s, [&](const Edge& e) { return s.angle(e); }); });
}
