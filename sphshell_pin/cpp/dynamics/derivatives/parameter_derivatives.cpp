// How contacts answer parameters of their pair.

#include "dynamics/derivatives/linearization.hpp"

namespace sphshell {

// The motion that a twist gives to the place of a contact.
static Vec3 motion_of(const Vector6& twist, const ContactSite& site) {
  const Vec3 turned = twist.tail<3>();
  return twist.head<3>() + turned.cross(site.place) + site.place_by_turn * turned;
}

// The velocities of the body stay as they are.
Linearization::Answer Linearization::displaced(const Vector6& by, const ContactSite& site,
                                               int rings) const {
  const Vec3 moved = motion_of(by, site), turned = by.tail<3>();
  Answer out;
  out.wrench = slopes_.by_place * moved + slopes_.by_turn * turned;
  out.depth = slopes_.depth_by_place * moved + slopes_.depth_by_turn.dot(turned.transpose());
  // The depth without the rise of a curved shell falls along the normal alone.
  out.plain_depth = out.depth + (site.shape ? site.shape->tilt.dot(moved) : 0.0);
  out.normal = slopes_.normal_by_place * moved;
  for (int i = 0; i < rings; ++i)
    out.rates[i] = slopes_.rings[i].rate_by_place * moved + slopes_.rings[i].rate_by_turn * turned;
  return out;
}

Linearization::Answer Linearization::answer_of(const Parameter& parameter,
                                               const ActiveContact& active,
                                               const ContactSite& site) {
  using Kind = Parameter::Kind;
  Answer out;
  const int rings = rings_of(active);
  for (int i = 0; i < rings; ++i) out.rates[i].setZero();
  // A moved sphere, or a shell moved the other way: the slopes by place and twist are known.
  if (parameter.kind == Kind::Offset || parameter.kind == Kind::Placement) {
    const Pair& pair = scene_.pairs()[active.pair];
    const SE3& world_from_j = scene_.states()[active.pair].world_from_j;
    Vector6 by = Vector6::Zero(), twist = Vector6::Zero(), frame = Vector6::Zero();
    if (pair.on_plane()) {
      // The shell, along an axis of its own frame.
      const SE3 shell =
          world_from_j.actInv(scene_.body().world_from(pair.joint_i, pair.placement_i));
      by = shell.toActionMatrix().col(parameter.axis);
    } else if (parameter.kind == Kind::Offset) {
      const auto from_i = scene_.body().world_from(pair.joint_i, pair.placement_i).rotation();
      by.head<3>() = world_from_j.rotation().transpose() * from_i.col(parameter.axis);
    } else {
      frame[parameter.axis] = 1;
      by = -frame;
      twist = -pinocchio::Motion(frame).cross(pinocchio::Motion(site.twist)).toVector();
    }
    out = displaced(by, site, rings);
    out.moved = frame;
    out.wrench += slopes_.by_twist * twist;
    for (int i = 0; i < rings; ++i) out.rates[i] += slopes_.rings[i].rate_by_twist * twist;
    return out;
  }
  if (parameter.kind != Kind::Field) {
    // A radius makes the contact deeper by as much, and by what the curved shell's rise adds.
    out.plain_depth = 1;
    out.depth = site.shape ? 1 + site.shape->tilt.dot(site.contact.normal) : 1;
    const bool held =
        std::visit([](const auto& forces) { return std::decay_t<decltype(forces)>::kDepthHeld; },
                   scene_.forces_of(active));
    if (held) out.wrench = out.depth * slopes_.by_depth;
    for (int i = 0; i < rings && held; ++i)
      out.rates[i] = out.depth * slopes_.rings[i].rate_by_depth;
  }
  add_differences(parameter, active, site, out);
  return out;
}

// What follows from a parameter besides the depth.
void Linearization::add_differences(const Parameter& parameter, const ActiveContact& active,
                                    const ContactSite& site, Answer& answer) {
  for (const double sign : {1.0, -1.0}) {
    const Pair& pair = sign > 0 ? parameter.more : parameter.less;
    const double share = sign / (2 * parameter.step);
    const bool found = std::visit(
        [&](const auto& one) { return one.changed(scene_, pair, active, site, other_slopes_); },
        scene_.forces_of(active));
    if (!found) continue;
    answer.wrench += share * other_slopes_.wrench;
    for (int i = 0; i < rings_of(active); ++i)
      answer.rates[i] += share * other_slopes_.rings[i].rate;
  }
}

// As generalized forces, and rates of bristles.
void Linearization::add_parameters(const ActiveContact& active, const ContactSite& site,
                                   const Chain& chain) {
  const Eigen::Index nv = force_.size(), z = nv + 3 * active.slot;
  for (std::size_t c = 0; c < parameters_.size(); ++c) {
    if (parameters_[c].pair != active.pair) continue;
    const Answer answer = answer_of(parameters_[c], active, site);
    for (int m = 0; m < chain.size(); ++m) {
      const auto axis = chain.axes().col(m);
      // The shell's frame, in which axes are written, moves with the placement.
      const Vector6 axis_moved =
          -pinocchio::Motion(answer.moved).cross(pinocchio::Motion(axis)).toVector();
      by_parameters_(chain.velocity(m), c) +=
          axis.dot(answer.wrench) + axis_moved.dot(slopes_.wrench);
    }
    for (int i = 0; i < rings_of(active); ++i)
      by_parameters_.block<3, 1>(z + 3 * i, c) += answer.rates[i];
  }
}

void Linearization::contact_forces(const VectorX& q, const VectorX& v, ContactForceSlopes& out) {
  const Eigen::Index nv = v.size(), nz = scene_.bristle_size(), first = 2 * nv + nz;
  std::vector<int> row_of;
  const int rows = scene_.rows_of_contacts(row_of);
  const Eigen::Index columns = first + static_cast<Eigen::Index>(parameters_.size());
  out.force_world.setZero(3 * rows, columns);
  out.normal_force.setZero(rows, columns);
  out.depth.setZero(rows, columns);
  out.plain_depth.setZero(rows, columns);
  if (rows == 0) return;
  Multibody& body = scene_.body();
  body.place_axes(q);
  const std::vector<ActiveContact>& all = scene_.active();
  for (std::size_t i = 0; i < all.size(); ++i) {
    const ActiveContact& active = all[i];
    const Pair& pair = scene_.pairs()[active.pair];
    const SE3& world_from_j = scene_.states()[active.pair].world_from_j;
    const auto& turn = world_from_j.rotation();
    Chain& chain = chains_[active.pair];
    if (i == 0 || all[i - 1].pair != active.pair) chain.place(body, world_from_j, v);
    const ContactSite site = site_of(active, chain.twist());
    find_slopes(active, site);
    const Vec3 normal = site.contact.normal, force = slopes_.wrench.head<3>();
    // Of a row's depth, as whole_of() takes it: a saddle by itself counts as its own depth.
    const double weight = site.contact.group < 0 ? 1 : site.contact.weight;
    const double side = pair.on_plane() ? -1 : 1;  // as in SceneData::log
    auto world = out.force_world.middleRows<3>(3 * row_of[i]);
    auto along = out.normal_force.row(row_of[i]);
    auto depth = out.depth.row(row_of[i]), plain = out.plain_depth.row(row_of[i]);
    // One column, from changes in the shell's frame.
    const auto add = [&](Eigen::Index column, const Vec3& force_by, const Vec3& normal_by,
                         double depth_by, double plain_by) {
      world.col(column) += side * (turn * force_by);
      along[column] += force_by.dot(normal) + force.dot(normal_by);
      depth[column] += weight * depth_by;
      plain[column] += weight * plain_by;
    };
    for (int m = 0; m < chain.size(); ++m) {
      const Vector6 axis = chain.axes().col(m), rate = chain.twist_by_q().col(m);
      const Answer by = displaced(axis, site, 0);
      const Vec3 by_q = by.wrench.head<3>() + slopes_.by_twist.topRows<3>() * rate;
      add(chain.velocity(m), by_q, by.normal, by.depth, by.plain_depth);
      add(nv + chain.velocity(m), slopes_.by_twist.topRows<3>() * axis, Vec3::Zero(), 0, 0);
    }
    // The shell's frame turns with its body.
    const Vec3 force_world = side * (turn * force);
    // In the world the force also turns with every joint that carries the shell.
    for (std::size_t j : body.model().supports[pair.joint_j]) {
      for (int k = 0; j > 0 && k < body.model().nvExtendeds[j]; ++k) {
        const Vec3 axis = body.axes().col(body.model().idx_vExtendeds[j] + k).tail<3>();
        world.col(body.model().idx_vs[j] + k) += axis.cross(force_world);
      }
    }
    for (int r = 0; r < rings_of(active); ++r)
      for (int k = 0; k < 3; ++k) {
        const Matrix63& by = slopes_.rings[r].by_stretch;
        add(2 * nv + 3 * (active.slot + r) + k, by.topRows<3>().col(k), Vec3::Zero(), 0, 0);
      }
    for (std::size_t c = 0; c < parameters_.size(); ++c) {
      if (parameters_[c].pair != active.pair) continue;
      const Answer answer = answer_of(parameters_[c], active, site);
      const Eigen::Index column = first + static_cast<Eigen::Index>(c);
      add(column, answer.wrench.head<3>(), answer.normal, answer.depth, answer.plain_depth);
      world.col(column) += side * (turn * answer.moved.tail<3>().cross(force));
    }
  }
}

}  // namespace sphshell
