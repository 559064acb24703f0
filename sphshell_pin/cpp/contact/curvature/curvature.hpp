// The shape of the gap between a sphere and a curved shell.
#pragma once

#include "contact/curvature/curvature_field.hpp"
#include "contact/laws/hertz.hpp"

namespace sphshell {

// Of one shell; one per thread. Around a crease the curvature goes from one wall's to the other's
// with the angle of the contact's normal.
class Curvature {
 public:
  explicit Curvature(const Shell& shell) : field_(shell) {}
  bool is_of(const Shell& shell) const { return &field_.shell() == &shell; }

  // At a contact of a sphere, its center in the shell's frame.
  ContactShape shape(const Contact& contact, const Vec3& center, double radius, bool want_second);

 private:
  // One wall at a crease, where the contact is.
  struct Wall {
    CurvatureField::Local local;
    Vec3 normal;
  };
  // A point of an element; `index` is that of the side or corner that a contact stays on. Of a side
  // the first parameter is that along it, and the second is not used.
  struct Place {
    int facet;
    Feature feature;
    int index;
    Eigen::Vector2d at;
    CubicPatch patch;

    Vec3 point() const;
  };
  // How a place's parameters, and the contact's normal there, follow the sphere's center.
  struct Motion {
    Eigen::Matrix<double, 2, 3> parameters;
    Mat3 normal;
  };

  // The face whose curvature is that of the contact, or null.
  const Primitive* face_at(const Place& place) const;
  Vec3 direction_of(const Place& place, const Vec3& center) const;  // of either sign
  ContactShape shape_at(const Place& place, double depth, const Vec3& center, const Vec3& normal,
                        double radius, Motion& motion);
  // Curvature and rise on a side or a corner, at the angle of the normal.
  CurvatureField::Local between_walls(const Place& place, const Vec3& normal, double length2);
  // Both fill walls_ with the pairs of walls that meet there.
  void find_walls_of_side(int facet, int side, double t, double length2);
  void find_walls_of_vertex(int facet, int corner, double length2);
  // What the field and the element say at a point.
  Wall wall(int facet, double u, double v, double length2);

  CurvatureField field_;
  std::vector<std::pair<Wall, Wall>> walls_;  // those that meet at a crease
  std::vector<int> corners_;
};

// The shapes of contacts as merge_groups() shows them.
void merge_shapes(const std::vector<Contact>& contacts, const std::vector<ContactShape>& shapes,
                  std::vector<ContactShape>& shown);

}  // namespace sphshell
