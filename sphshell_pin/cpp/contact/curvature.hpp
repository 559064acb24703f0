// The curvature of a curved shell where a sphere touches it.
#pragma once

#include <unordered_map>
#include <utility>
#include <vector>

#include "contact/contact.hpp"
#include "contact/hertz.hpp"
#include "shell/curved.hpp"
#include "shell/vertex_curvature.hpp"

namespace sphshell {

// The curvature tensor of the surface that the elements were made from, continuous all over the
// shell. The second derivatives of the cubic elements are off by the square of their size; it is
// fitted at the vertices instead, and carried into the elements by cubics that match its first
// derivatives as well. It is zero in flat elements and on their smooth borders. Around a crease it
// goes from one wall's to the other's with the angle of the contact's normal.
//
// What was fitted is kept: one per thread.
class Curvature {
 public:
  // Of a sphere, its center in the shell's frame, and the shell about a contact.
  ContactShape shape(const Shell& shell, const Contact& contact, const Vec3& center, double radius,
                     bool want_second);

 private:
  // A symmetric tensor: xx, yy, zz, xy, xz, yz.
  using Tensor = Eigen::Matrix<double, 6, 1>;
  // The curvature at a place [1/m], and how far beyond the element the surface lies, along the
  // element's normal [m].
  using Local = Eigen::Matrix<double, 7, 1>;

  // How far the surface lies beyond an element: zero at the corners, and as the fits at both ends
  // say at four points of each side, and in the middle.
  class Rise {
   public:
    double middle = 0;  // beyond what the sides give there

    void set_side(int k, const double (&at)[4]);
    // Value and derivatives by u and v.
    Eigen::Vector3d at(double u, double v) const;

   private:
    double even_[3][2] = {}, odd_[3][2] = {};
  };
  struct Field {
    Cubic2<Tensor> tensor;
    Rise rise;

    Local at(double u, double v) const;
  };

  // Of the elements of one surface that are joined smoothly at a vertex.
  struct Fan {
    VertexCurvature fit;
    Tensor tensor;  // that holds at the vertex, where others are joined to them
  };
  // One wall at a crease, where the contact is.
  struct Wall {
    Local local;
    Vec3 normal;
  };
  // A point of an element; `index` is that of the side or corner that a contact stays on.
  struct Place {
    int facet;
    Feature feature;
    int index;
    double u, v;
    CubicPatch patch;
  };
  // How a place, and the contact's normal there, follow the sphere's center.
  struct Motion {
    Eigen::Matrix<double, 2, 3> parameters;
    Mat3 normal;
  };

  ContactShape shape_at(const Shell& shell, const Place& place, double depth, const Vec3& center,
                        const Vec3& normal, double radius, Motion& motion);
  Rise rise_of(const Shell& shell, int facet);
  Local between_walls(const Shell& shell, const Place& place, const Vec3& normal);
  void find_walls_of_side(const Shell& shell, int facet, int side, double t);
  void find_walls_of_vertex(const Shell& shell, int facet, int corner);
  Wall wall(const Shell& shell, int facet, double u, double v);
  const Field& field(const Shell& shell, int facet);
  const Fan& fan(const Shell& shell, int facet, int corner);
  VertexCurvature fit_at(const Shell& shell, int corner);
  static void collect_fan(const Shell& shell, int corner, bool all, std::vector<int>& corners);
  int owner_of_side(const Shell& shell, int facet, int side);
  std::pair<Tensor, Tensor> along_side(const Shell& shell, int facet, int side);
  double beyond(const Shell& shell, int facet, double u, double v);

  static Mat3 matrix(const Tensor& t);
  static Tensor tensor(const Mat3& m);

  std::unordered_map<int, int> fan_of_, field_of_;  // of corners (3 facet + k), of facets
  std::vector<Fan> fans_;
  std::vector<Field> fields_;
  std::vector<std::pair<Wall, Wall>> walls_;  // those that meet at a crease
  std::vector<int> corners_, beside_;
  std::vector<OrientedPoint> around_;
};

// The shapes of contacts as merge_groups() shows them.
void merge_shapes(const std::vector<Contact>& contacts, const std::vector<ContactShape>& shapes,
                  std::vector<ContactShape>& shown);

}  // namespace sphshell
