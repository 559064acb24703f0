// What the package is measured against, as compiled loops: bare dynamics and Coal's collision.
#include "bindings/interop.hpp"

#include <coal/BVH/BVH_model.h>
#include <coal/collision.h>
#include <coal/shape/geometric_shapes.h>

#include <algorithm>
#include <chrono>

#include "bindings/records.hpp"
#include "dynamics/multibody.hpp"
#include "dynamics/scene_data.hpp"

#include <nanobind/eigen/dense.h>
#include <nanobind/stl/vector.h>

namespace sphshell {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// Seconds per step of ABA and integrate alone, without contact, controller, record or audit.
double bare_dynamics(nb::handle model, VectorX q, VectorX v, double dt, int steps) {
  Multibody body(model_of(model));
  const VectorX tau = VectorX::Zero(v.size());
  VectorX next = q, step = v;
  const auto start = Clock::now();
  for (int i = 0; i < steps; ++i) {
    v += dt * body.acceleration(q, v, tau);
    step = dt * v;
    body.integrate(q, step, next);
    q.swap(next);
  }
  return seconds_since(start) / steps;
}

// Seconds that each part of a step of semi-implicit Euler takes at one state, again and again.
// "law" holds the forces of the contacts and what gathers and audits them.
nb::dict step_parts(nb::handle model, const std::vector<const Pair*>& pairs, const VectorX& q,
                    const VectorX& v, double dt, int repeats) {
  SceneData scene(model_of(model), copies(pairs));
  const VectorX z = VectorX::Zero(scene.bristle_size()), tau = VectorX::Zero(v.size());
  const VectorX step = dt * v;
  VectorX next = q;
  scene.evaluate(q, v, z);
  std::vector<Query> queries(pairs.size(), Query(true));
  const auto time = [&](auto&& part) {
    const auto start = Clock::now();
    for (int i = 0; i < repeats; ++i) part();
    return seconds_since(start) / repeats;
  };
  Multibody& body = scene.body();
  nb::dict out;
  const double kinematics = time([&] { body.kinematics(q, v); });
  const double query = time([&] {
    for (std::size_t k = 0; k < pairs.size(); ++k)
      if (pairs[k]->shell)
        queries[k].find(*pairs[k]->shell, scene.states()[k].center, pairs[k]->radius,
                        pairs[k]->method);
  });
  const double evaluation = time([&] { scene.evaluate(q, v, z); });
  out["kinematics"] = kinematics;
  out["query"] = query;
  out["law"] = std::max(evaluation - kinematics - query, 0.0);
  out["aba"] = time([&] { scene.acceleration(q, v, tau); });
  out["integrate"] = time([&] { body.integrate(q, step, next); });
  return out;
}

// Seconds per query and contacts per query of coal::collide with all contacts.
auto coal_collide_all(const Points& vertices, const IntTriples& triangles, const Points& centres,
                      double radius) {
  auto mesh = std::make_shared<coal::BVHModel<coal::OBBRSS>>();
  coal::MatrixX3s points(vertices.shape(0), 3);
  for (std::size_t i = 0; i < vertices.shape(0); ++i) points.row(i) = row(vertices, i).transpose();
  coal::Matrixx3i corners(triangles.shape(0), 3);
  for (std::size_t t = 0; t < triangles.shape(0); ++t)
    for (int k = 0; k < 3; ++k) corners(t, k) = static_cast<unsigned>(triangles(t, k));
  mesh->beginModel(static_cast<unsigned>(triangles.shape(0)),
                   static_cast<unsigned>(vertices.shape(0)));
  mesh->addVertices(points);
  mesh->addTriangles(corners);
  mesh->endModel();
  const coal::Sphere sphere(radius);
  coal::CollisionRequest request(coal::CONTACT, 1000000);
  const coal::Transform3s identity;
  std::size_t found = 0;
  coal::CollisionResult result;
  const auto start = Clock::now();
  for (std::size_t i = 0; i < centres.shape(0); ++i) {
    result.clear();
    coal::collide(&sphere, coal::Transform3s(row(centres, i)), mesh.get(), identity, request,
                  result);
    found += result.numContacts();
  }
  const double n = static_cast<double>(centres.shape(0));
  return nb::make_tuple(seconds_since(start) / n, static_cast<double>(found) / n);
}

}  // namespace
}  // namespace sphshell

void bind_reference(nanobind::module_& m) {
  using namespace sphshell;
  m.def("bare_dynamics", &bare_dynamics, nb::arg("model"), nb::arg("q"), nb::arg("v"),
        nb::arg("dt"), nb::arg("steps"));
  m.def("step_parts", &step_parts, nb::arg("model"), nb::arg("pairs"), nb::arg("q"), nb::arg("v"),
        nb::arg("dt"), nb::arg("repeats"));
  m.def("coal_collide_all", &coal_collide_all, nb::arg("vertices"), nb::arg("triangles"),
        nb::arg("centers"), nb::arg("radius"));
  m.attr("pinocchio_version") = PINOCCHIO_VERSION;
  m.attr("coal_version") = COAL_VERSION;
}
