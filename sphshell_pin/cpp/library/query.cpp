#include "library/checks.hpp"
#include "library/impl.hpp"

namespace sphshell_pin {

// To the library's own type, which does not change with the core's.
static void convert(const std::vector<core::Contact>& from, std::vector<Contact>& to) {
  to.clear();
  for (const core::Contact& c : from)
    to.push_back(
        {c.point, c.normal, c.depth, c.element, static_cast<Feature>(c.feature), c.weight});
}

// Enumerators can be made of any number.
core::Method checked(Method method) {
  const int number = static_cast<int>(method);
  if (number < 0 || number > 2)
    throw InvalidParameter("method", std::to_string(number),
                           "must be Method::Facets, Elements or Smooth");
  return static_cast<core::Method>(number);
}

struct Query::Impl {
  core::Query query;
  std::vector<core::Contact> merged;
  std::vector<Contact> shown, terms;
};

Query::Query() : impl_(new Impl) {}

const std::vector<Contact>& Query::contacts(const Shell& shell, const Eigen::Vector3d& center,
                                            double radius, Method method) {
  check_point("center", center);
  check_positive("radius", radius, " [m]");
  const core::Method how = checked(method);
  const auto& found = impl_->query.find(*shell.impl().with(method), center, radius, how);
  // Shown: contacts of one group as one. Terms: each minimum and saddle, as forces are made of.
  core::merge_groups(found, center, radius, impl_->merged);
  convert(found, impl_->terms);
  convert(impl_->merged, impl_->shown);
  return impl_->shown;
}

const std::vector<Contact>& Query::terms() const { return impl_->terms; }

ClosestPoint Query::closest_point(const Shell& shell, const Eigen::Vector3d& point, Method method) {
  check_point("point", point);
  checked(method);
  const core::Shell& surface = *shell.impl().with(method);
  core::SurfacePoint at = surface.closest_point(point);
  // The flat shell's point first, as a start.
  if (method == Method::Smooth) at = core::on_curved(surface, point, at, impl_->query);
  return {at.point, at.normal, at.distance, at.element};
}

}  // namespace sphshell_pin
