// What Python says of a controller or of a sensor: arrays by the names of fields.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "dynamics/control/target_path.hpp"
#include "dynamics/scene/geometry.hpp"   // SE3
#include "dynamics/scene/multibody.hpp"  // VectorX

namespace sphshell {

// Arrays are flat, in the order of rows. A field that is not there is a fault of the caller's.
struct Fields {
  std::map<std::string, VectorX> values;

  const VectorX& vector(const char* name) const { return values.at(name); }
  double number(const char* name) const { return vector(name).value(); }
  int integer(const char* name) const { return static_cast<int>(number(name)); }
  std::vector<double> list(const char* name) const {
    const VectorX& all = vector(name);
    return {all.begin(), all.end()};
  }
  std::vector<int> integers(const char* name) const {
    const VectorX& all = vector(name);
    return {all.begin(), all.end()};
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

}  // namespace sphshell
