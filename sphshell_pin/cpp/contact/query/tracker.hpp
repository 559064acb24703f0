// Which contact goes on from which, from one accepted step to the next.
#pragma once

#include "contact/query/query.hpp"

namespace sphshell {

// A contact keeps its number, and its slot in the state, while it moves over elements and smooth
// edges, in the shell's frame. It goes on from the nearest place that it can have come from: within
// the radius of the disc of contact, sqrt(r^2 - (r - d)^2), or within reach of the center's motion.
class ContactTracker {
 public:
  struct Place {
    Vec3 point, normal;  // the normal points where the sphere is pushed
    double depth, reach;
    bool saddle, rim;
    Feature feature;
    int number;
    bool taken = false;  // by a contact of the last match()
  };

  ContactTracker();

  // Beside the contacts: their places, by index. The known ones come first, then those that were
  // new in this step. A contact whose sphere's center was pushed through the shell is turned, so
  // that it is pushed back. radius 0: of no sphere, any distance is near.
  const std::vector<int>& match(std::vector<Contact>& contacts, const Vec3& center, double radius);
  // The contacts last matched are the known ones from now on, in their order.
  void accept(const std::vector<Contact>& contacts, const Vec3& center, double radius);
  // Without contacts, the center is all there is to remember.
  void move_to(const Vec3& center) { center_ = center; }
  // Puts others in the place of all that is remembered; the first `known` are the known ones.
  void restore(std::vector<Place> places, std::size_t known, const Vec3& center, int next_number,
               double radius);
  // Forgets what was new since the last accept().
  void restart() { places_.resize(known_), count_ = next_number_; }

  const std::vector<Place>& places() const { return places_; }
  std::size_t known() const { return known_; }
  const Vec3& center() const { return center_; }
  // Of the contact that comes next to be accepted.
  int next_number() const { return next_number_; }
  // True where the center may have come to the other side of the shell.
  bool deep() const { return deep_; }
  // True where a contact of the last match() was turned.
  bool pushed_through() const { return pushed_through_; }

 private:
  struct Pairing {
    double apart;
    int from, to;
  };

  // The radius of the disc of contact [m]; infinite of no sphere.
  static double disc(double depth, double radius);
  static Place place_of(const Contact& contact, double radius, int number);
  void keep_side(Contact& contact, const Place& place, double radius);

  std::vector<Place> places_, next_;
  std::size_t known_ = 0;
  Vec3 center_ = Vec3::Zero();
  bool deep_ = false, pushed_through_ = false;
  std::vector<Pairing> pairings_;
  std::vector<int> at_;
  int count_ = 0, next_number_ = 0;
};

}  // namespace sphshell
