// Where pairs touch at a state, or would, and how they can move there: what a run begins with.
#pragma once

#include <Eigen/Eigenvalues>

#include "dynamics/scene/multibody.hpp"
#include "dynamics/scene/pair.hpp"

namespace sphshell {

// The gap [m]; what a force along the normal, or across it where that is least, has to move [kg],
// nan where the bodies cannot move; the speed along the normal [m/s]. All nan of a source that
// finds nothing.
struct Touch {
  double gap, mass, slip_mass, speed;
};

inline std::vector<Touch> touches_at(Multibody& body, const std::vector<Pair>& pairs,
                                     const VectorX& q, const VectorX& v) {
  constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
  const auto mass_of = [](double mobility) { return mobility > 1e-12 ? 1 / mobility : kNothing; };
  std::vector<Touch> out;
  Query query;
  body.place(q);
  for (const Pair& pair : pairs) {
    const SE3 pose_i = body.world_from(pair.joint_i, pair.placement_i);
    const SE3 pose_j = body.world_from(pair.joint_j, pair.placement_j);
    const Vec3 center = pose_j.actInv(pose_i.translation());
    const Contact at = pair.ask([&](const auto& geometry) {
      return geometry.nearest(pose_i, pose_j, center, pair.radius, query);
    });
    if (at.element < 0) {
      out.push_back({kNothing, kNothing, kNothing, kNothing});
      continue;
    }
    const Vec3 point = pose_j.act(at.point), normal = pose_j.rotation() * at.normal;
    MatrixX jacobian = MatrixX::Zero(3, v.size());
    body.add_jacobian(pair.joint_i, point, 1, jacobian);
    body.add_jacobian(pair.joint_j, point, -1, jacobian);
    const Mat3 mobility = body.mobility(jacobian);
    const Mat3 across = Mat3::Identity() - normal * normal.transpose();
    const double slip =
        Eigen::SelfAdjointEigenSolver<Mat3>(across * mobility * across, Eigen::EigenvaluesOnly)
            .eigenvalues()
            .maxCoeff();
    out.push_back({-at.depth, mass_of(normal.dot(mobility * normal)), mass_of(slip),
                   std::abs(normal.dot(jacobian * v))});
  }
  return out;
}

}  // namespace sphshell
