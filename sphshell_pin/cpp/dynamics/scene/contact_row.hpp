// A contact as runs record it and Python reads it, by named fields.
#pragma once

#include <cstddef>

#include "contact/query/contact.hpp"

namespace sphshell {

// Points and vectors in the world, SI units.
struct ContactRow {
  double point[3], normal[3], depth, normal_force, friction_force[3], slip_velocity[3];
  std::int32_t pair, element, contact_id;
  Feature feature;
};

// The patch of a ContactRow by Hertz's geometry, where a run is asked for patches; nan where the
// geometry of the contact is unknown. At a saddle the pressures are negative, as its force is.
struct PatchRow {
  double half_axes[2];                  // a >= b [m]
  double axis[3];                       // unit, direction of a in the world
  double peak_pressure, mean_pressure;  // [Pa]
  double approach;                      // [m]
};

// The fields of a row; Python's structured type is made of them.
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
inline constexpr RowField kPatchRowFields[] = {
    {"half_axes", "f8", 2, offsetof(PatchRow, half_axes)},
    {"axis_world", "f8", 3, offsetof(PatchRow, axis)},
    {"peak_pressure", "f8", 1, offsetof(PatchRow, peak_pressure)},
    {"mean_pressure", "f8", 1, offsetof(PatchRow, mean_pressure)},
    {"approach", "f8", 1, offsetof(PatchRow, approach)},
};

}  // namespace sphshell
