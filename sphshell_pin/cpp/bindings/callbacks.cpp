#include "bindings/interop.hpp"

#include "bindings/callbacks.hpp"

#include <nanobind/eigen/dense.h>

#include "bindings/records.hpp"

namespace sphshell {
namespace {

using RowPoints = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

}  // namespace

PythonSource::~PythonSource() {
  if (!find_.is_valid()) return;
  const AcquireGil gil;
  find_.reset();
}

void PythonSource::operator()(const SE3& pose_i, const SE3& pose_j,
                              std::vector<Contact>& out) const {
  const AcquireGil gil;
  const nb::object answer = gil.call(find_, to_python(pose_i), to_python(pose_j));
  const auto points = nb::cast<RowPoints>(answer[0]);
  const auto normals = nb::cast<RowPoints>(answer[1]);
  const auto depths = nb::cast<VectorX>(answer[2]);
  for (Eigen::Index i = 0; i < depths.size(); ++i)
    if (depths[i] > 0)
      out.push_back({points.row(i).transpose(), normals.row(i).transpose(), depths[i],
                     static_cast<int>(i), Feature::Face});
}

PythonController::~PythonController() {
  const AcquireGil gil;
  callable_.reset();
}

void PythonController::torque(Scene& scene, double t, const VectorX& q, const VectorX& v,
                              VectorX& tau) {
  std::vector<ContactRow> rows;
  scene.log(q, v, rows);
  const AcquireGil gil;
  tau = nb::cast<VectorX>(gil.call(callable_, t, q, v, rows_to_array(std::move(rows))));
}

int visit_sources(const std::vector<Pair>& pairs, visitproc visit, void* arg) {
  for (const Pair& pair : pairs)
    if (const auto* source = pair.source.target<PythonSource>()) Py_VISIT(source->find().ptr());
  return 0;
}

}  // namespace sphshell
