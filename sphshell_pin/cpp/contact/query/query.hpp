// Where a sphere touches a shell.
#pragma once

#include "contact/query/contact.hpp"
#include "shell/shell.hpp"

namespace sphshell {

// Scratch of one query; keep one per thread and pair, and queries use no heap once it has grown.
// With `follow`, the facets near a sphere are kept while it moves little from call to call (same
// shell and radius); the contacts are the same to the bit. A copy starts with new scratch.
class Query {
 public:
  explicit Query(bool follow = false);
  Query(const Query& other);
  Query& operator=(const Query& other);
  ~Query();

  // The contacts of the sphere (center in the shell's frame [m]), minima first, the deepest in
  // front, then saddles; valid until the next call. With `rings` a contact all around an axis is
  // the mean of the circle, else one of its points.
  const std::vector<Contact>& find(const Shell& shell, const Vec3& center, double radius,
                                   Method method, bool rings = true);

  // Those of a half-space below a plane, at `offset` along its unit normal, in the shell's frame:
  // the minima of the height over it that are below, on curved elements, with their saddles.
  const std::vector<Contact>& find_below(const Shell& shell, const Vec3& normal, double offset);

  // Also find dn_dc; not for the method "elements".
  void want_dn_dc();

  std::vector<Contact> contacts;

 private:
  struct Parts;
  template <class Probe>
  const std::vector<Contact>& list(const Shell& shell, const Probe& probe, bool rings);
  std::unique_ptr<Parts> parts_;
};

// Whether contact i leads those that are shown as one with it.
bool leads(const std::vector<Contact>& contacts, std::size_t i);

// The contact that i leads: those of its group as one, with their resultant.
Contact whole_of(const std::vector<Contact>& contacts, std::size_t i, const Vec3& center,
                 double radius);

// The contacts as shown: those of one group as one, with their resultant.
void merge_groups(const std::vector<Contact>& contacts, const Vec3& center, double radius,
                  std::vector<Contact>& shown);

// The place of the curved surface beside that of the flat one, `at`: the deepest contact of a
// sphere that reaches it.
SurfacePoint on_curved(const Shell& shell, const Vec3& point, SurfacePoint at, Query& query);

}  // namespace sphshell
