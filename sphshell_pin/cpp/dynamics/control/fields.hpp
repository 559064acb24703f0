// What Python says of a controller or of a sensor: arrays by the names of fields.
#pragma once

#include <map>
#include <stdexcept>
#include <string>

#include "dynamics/scene/geometry.hpp"   // SE3
#include "dynamics/scene/multibody.hpp"  // VectorX

namespace sphshell {

// Vectors in rows, as NumPy's arrays have them.
using PathPoints = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

// Arrays are flat, in the order of rows. A field that is not there is a fault of the caller's. Its
// readers derive from it, and name each field where they declare what holds it.
struct Fields {
  std::map<std::string, VectorX> values;

  const VectorX& vector(const char* name) const { return values.at(name); }
  double number(const char* name) const { return vector(name).value(); }
  int integer(const char* name) const { return static_cast<int>(number(name)); }
  bool flag(const char* name) const { return number(name) != 0; }
  template <class Number = double>
  std::vector<Number> list(const char* name) const {
    return {vector(name).begin(), vector(name).end()};
  }
  PathPoints points(const char* name) const {
    const VectorX& all = vector(name);
    return Eigen::Map<const PathPoints>(all.data(), all.size() / 3, 3);
  }
  // Of a homogeneous matrix.
  SE3 frame(const char* name) const {
    using Matrix = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
    return SE3(Eigen::Matrix4d(Eigen::Map<const Matrix>(vector(name).data())));
  }
};

// A line of a table of classes of one base, by the kind that files call them.
template <class Base>
struct KindOf {
  const char* kind;
  std::shared_ptr<Base> (*make)(const Fields&);
};

template <class Base, class Class>
std::shared_ptr<Base> make_of(const Fields& fields) {
  return std::make_shared<Class>(fields);
}

template <class Base, std::size_t n>
std::shared_ptr<Base> make_from(const KindOf<Base> (&table)[n], const std::string& kind,
                                const Fields& fields) {
  for (const KindOf<Base>& one : table)
    if (kind == one.kind) return one.make(fields);
  throw std::invalid_argument("no class of the kind '" + kind + "'");
}

}  // namespace sphshell
