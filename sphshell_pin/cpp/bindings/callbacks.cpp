#include "bindings/interop.hpp"

#include "bindings/law_integral.hpp"

#include <cstring>

namespace sphshell {
namespace {

// Numbers go to and fro as plain memory: NumPy gives the interpreter's lock away when it copies,
// and might not get it back (see gil.hpp).
template <class T>
PyObject* bytes_of(const T* first, std::size_t count) {
  return PyByteArray_FromStringAndSize(reinterpret_cast<const char*>(first),
                                       static_cast<Py_ssize_t>(count * sizeof(T)));
}

// A tuple that owns the items; null, and all items released, where one of them is null.
PyObject* pack(const std::vector<PyObject*>& items) {
  PyObject* out = PyTuple_New(static_cast<Py_ssize_t>(items.size()));
  bool complete = out != nullptr;
  Py_ssize_t i = 0;
  for (PyObject* item : items) {
    complete = complete && item != nullptr;
    if (out)
      PyTuple_SET_ITEM(out, i++, item);
    else
      Py_XDECREF(item);
  }
  if (complete) return out;
  Py_XDECREF(out);
  return nullptr;
}

// The doubles of an array, which its Python wrapper has made contiguous.
std::vector<double> doubles_of(nb::handle array) {
  Py_buffer view;
  if (PyObject_GetBuffer(array.ptr(), &view, PyBUF_SIMPLE) != 0) throw nb::python_error();
  std::vector<double> out(static_cast<std::size_t>(view.len) / sizeof(double));
  if (!out.empty()) std::memcpy(out.data(), view.buf, out.size() * sizeof(double));
  PyBuffer_Release(&view);
  return out;
}

}  // namespace

Routine::Routine(const Routine& other) {
  const AcquireGil gil;
  object_ = other.object_;
}

Routine::~Routine() {
  if (!object_.is_valid()) return;
  const AcquireGil gil;
  object_.reset();
}

// A number from Python: a float, as the wrapper has checked.
double call_law(nb::handle callable, const std::vector<double>& where) {
  const AcquireGil gil;
  const nb::object answer = gil.call(callable, [&] {
    std::vector<PyObject*> numbers;
    for (double x : where) numbers.push_back(PyFloat_FromDouble(x));
    return pack(numbers);
  });
  return PyFloat_AsDouble(answer.ptr());
}

// Poses go to Python as pinocchio.SE3, arrays come back as plain memory; the number of a contact in
// the list is its element.
void PythonSource::operator()(const SE3& pose_i, const SE3& pose_j,
                              std::vector<Contact>& out) const {
  const AcquireGil gil;
  const nb::object answer = gil.call(object(), [&] {
    return pack({to_python(pose_i).release().ptr(), to_python(pose_j).release().ptr()});
  });
  const std::vector<double> points = doubles_of(answer[0]), normals = doubles_of(answer[1]),
                            depths = doubles_of(answer[2]);
  for (std::size_t i = 0; i < depths.size(); ++i)
    out.push_back({Vec3(&points[3 * i]), Vec3(&normals[3 * i]), depths[i], static_cast<int>(i),
                   Feature::Face});
}

// The contacts are those of the state, as rows; the torques of the answer were checked by the
// wrapper.
void PythonController::torque(SceneData& scene, double t, const VectorX& q, const VectorX& v,
                              VectorX& tau) {
  std::vector<ContactRow> rows;
  scene.log(q, v, rows);
  const AcquireGil gil;
  const nb::object answer = gil.call(object(), [&] {
    std::vector<PyObject*> items{PyFloat_FromDouble(t), bytes_of(q.data(), q.size()),
                                 bytes_of(v.data(), v.size()), bytes_of(rows.data(), rows.size())};
    if (readings_) items.push_back(bytes_of(readings_->data(), readings_->size()));
    return pack(items);
  });
  const std::vector<double> torque = doubles_of(answer);
  tau = Eigen::Map<const VectorX>(torque.data(), static_cast<Eigen::Index>(torque.size()));
}

void look_at(const NormalLaw& law, Visitor& visitor) {
  const auto* own = std::get_if<FunctionLaw>(&law.law);
  if (!own) return;
  if (const auto* force = own->function.target<LawForce>()) visitor(force->object());
  if (const auto* energy = own->potential.target<LawEnergy>()) visitor(energy->object());
  if (const auto* energy = own->potential.target<LawIntegral>()) visitor(energy->force().object());
}

void look_at(const FrictionLaw& friction, Visitor& visitor) {
  if (const auto* own = std::get_if<FunctionFriction>(&friction.law))
    if (const auto* force = own->function.target<LawForce>()) visitor(force->object());
}

void look_at(const Pair& pair, Visitor& visitor) {
  if (const auto* points = std::get_if<SourcePoints>(&pair.geometry))
    if (const auto* own = points->source.target<PythonSource>()) visitor(own->object());
  look_at(pair.friction, visitor);
  look_at(pair.law, visitor);
}

void look_at(const std::vector<Pair>& pairs, Visitor& visitor) {
  for (const Pair& pair : pairs) look_at(pair, visitor);
}

}  // namespace sphshell
