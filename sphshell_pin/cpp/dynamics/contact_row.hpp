// A contact as runs record it and Python reads it, by named fields.
#pragma once

#include <cstddef>
#include <cstdint>

#include "contact/contact.hpp"

namespace sphshell {

// Points and vectors in the world, SI units.
struct ContactRow {
  double point[3], normal[3], depth, normal_force, friction_force[3], slip_velocity[3];
  std::int32_t pair, element, contact_id;
  Feature feature;
};

// The fields of a ContactRow; Python's structured type is made of them.
struct RowField {
  const char* name;
  const char* type;  // NumPy's
  int size;
  std::size_t offset;
};
inline constexpr RowField kContactRowFields[] = {
    {"pair", "i4", 1, offsetof(ContactRow, pair)},
    {"point_world", "f8", 3, offsetof(ContactRow, point)},
    {"normal_world", "f8", 3, offsetof(ContactRow, normal)},
    {"depth", "f8", 1, offsetof(ContactRow, depth)},
    {"normal_force", "f8", 1, offsetof(ContactRow, normal_force)},
    {"friction_force_world", "f8", 3, offsetof(ContactRow, friction_force)},
    {"slip_velocity_world", "f8", 3, offsetof(ContactRow, slip_velocity)},
    {"element", "i4", 1, offsetof(ContactRow, element)},
    {"feature", "u1", 1, offsetof(ContactRow, feature)},
    {"contact_id", "i4", 1, offsetof(ContactRow, contact_id)},
};

}  // namespace sphshell
