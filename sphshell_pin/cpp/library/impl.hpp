// What the public classes hold.
#pragma once

#include "contact/query/query.hpp"
#include "shell/curved/curved.hpp"
#include "sphshell_pin/query.hpp"

namespace sphshell_pin {

namespace core = ::sphshell;

struct Shell::Impl {
  std::shared_ptr<core::Shell> shell;
  std::vector<Eigen::Vector3d> normals;  // per triangle corner, or empty
  mutable std::once_flag curved;
  mutable std::shared_ptr<core::Shell> smooth;  // with curved elements; often `shell` itself

  // The surface, with curved elements where the method needs them.
  const std::shared_ptr<core::Shell>& with(Method method) const {
    if (method != Method::Smooth) return shell;
    std::call_once(curved, [&] {
      // With no smooth edges every element is flat, whatever normals came with it.
      core::CurveOptions options;
      if (shell->crease_angle() > 0) options.normals = normals;
      smooth = core::curve(shell, std::move(options));
    });
    return smooth;
  }
};

core::Method checked(Method method);

}  // namespace sphshell_pin
