// Where a sphere touches a shell.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "shell/shell.hpp"

namespace sphshell {

using Mat3 = Eigen::Matrix3d;

// A place of a curved element, and what the distance is there.
struct PatchPoint {
  double u, v;
  Vec3 point;
};
enum class Stationary { Minimum, Saddle };

enum class Method : int { Facets = 0, Elements = 1, Smooth = 2 };
enum class Feature : std::uint8_t { Face = 0, Edge = 1, Vertex = 2 };

struct Contact {
  Vec3 point;    // on the shell
  Vec3 normal;   // unit, from the shell to the sphere's centre: a push along it
  double depth;  // radius - distance > 0 [m]
  int element;
  Feature feature;
  // Of its force: below zero at a pass between contacts that flow together; where they are nearly
  // one and were merged, nearly one.
  double weight = 1;
  // Where asked for: derivative of weight * normal with respect to the sphere's centre [1/m].
  Mat3 turn = Mat3::Zero();
  bool rim = false;  // on the border of an open sheet: there it has no sides

  double energy_weight() const { return weight > 0 ? 1 : weight; }
};

// Scratch of one query; keep one per thread and pair, and queries use no heap once it has grown.
// With `follow`, the facets near a sphere are kept while it moves little from call to call (same
// shell and radius); the contacts are the same to the bit.
class Query {
 public:
  explicit Query(bool follow = false);

  // The contacts of the sphere (centre in the shell's frame [m]); valid until the next call.
  const std::vector<Contact>& find(const Shell& shell, const Vec3& centre, double radius,
                                   Method method);

  // Also find how the normals turn as the sphere moves; not for the method "elements".
  void want_turns() { turns_ = true; }

  std::vector<Contact> contacts;

 private:
  // A facet whose plane the centre projects into, an edge or a vertex the centre stands over.
  struct FaceClaim {
    int facet;
  };
  struct EdgeClaim {
    int facet, side, from, to;  // from, to: its vertices
  };
  struct VertexClaim {
    int facet, vertex;
  };
  // Where the centre's projection on a facet's plane falls.
  struct Shadow {
    int facet;
    double height;                 // above the plane [m]
    double inward[3], length2[3];  // within side k by inward / sqrt(length2) [m]
    double opening;                // NormalCone::tan_opening
    double lean;                   // as far beyond the facet it may be [m]

    // The centre stands over a contact along a normal that leans at most by the opening, so its
    // shadow falls within `lean` of the feature that holds the contact.
    void allow(double bulge, double tolerance) {
      lean = opening >= kAnyOpening ? std::numeric_limits<double>::infinity()
                                    : bulge + tolerance + (std::abs(height) + bulge) * opening;
    }

    bool beyond(int k) const {
      return inward[k] < 0 && inward[k] * inward[k] > lean * lean * length2[k];
    }
    bool near_side(int k) const {
      return inward[k] <= 0 || inward[k] * inward[k] <= lean * lean * length2[k];
    }
  };
  struct Carrier {
    Vec3 outward;  // pseudo-normal of the feature that carries a contact
    bool rim;      // on the border of an open sheet: no inside there
  };

  // A minimum of the distance, or a pass between two.
  struct Row {
    Contact contact;
    Carrier carrier;
    int facet;    // that holds it
    int merged;   // the row that it is one contact with, or itself
    Vec3 normal;  // of all that is merged into it
    double depth;
    Mat3 turn = Mat3::Zero();
  };
  struct Saddle {
    Row pass;
    Vec3 downhill;  // one of the two ways
  };
  // Where two facets touch: nearest to the centre on their common side, or above a bound of it; or,
  // with facet -1, the saddle number `side`. a, b: facets, and once exact their nodes.
  struct Link {
    double depth;
    bool exact;
    int a, b, facet, side;
    double t;
  };

  void find_facets(const Shell& shell, const Vec3& centre, double radius);
  void find_smooth(const Shell& shell, const Vec3& centre, double radius);
  void find_elements(const Shell& shell, const Vec3& centre, double radius);
  void gather(const Shell& shell, const LargeArray<NormalCone>& cones, double bulge,
              const Vec3& centre, double radius);
  void keep_in_cone(const Shell& shell, const LargeArray<NormalCone>& cones, const Vec3& centre,
                    double radius, double margin, double bulge);
  void claim_on_patches(const Shell& shell, const Vec3& centre, double radius, double tolerance);
  void claim_flat(const Shell& shell, const Shadow& shadow, const Vec3& centre, double radius,
                  double tolerance);
  void claim_curved(const Shell& shell, const Shadow& shadow, const Vec3& centre, double radius);
  void claim_edge(const Shell& shell, int facet, int side, const Vec3& centre, double radius,
                  double tolerance);
  void claim_on_side(const Shell& shell, int facet, int side, double t, const Vec3& centre,
                     double radius, double tolerance);
  void claim_vertex(const Shell& shell, int facet, int corner, const Vec3& centre, double radius,
                    double tolerance);
  void claim_nearest(const Shell& shell, const Vec3& centre, double radius);
  static Carrier carrier_at(const Shell& shell, int f, const PatchPoint& at, const Vec3& outward);
  void add_minimum(const Shell& shell, const Contact& contact, int facet, const Carrier& carrier);
  void join_minima(const Shell& shell, const Vec3& centre, double radius);
  void list_minima(double same);
  void list_links(const Shell& shell, const Vec3& centre, double radius);
  bool settle(const Shell& shell, Link& link, const Vec3& centre, double radius) const;
  void join_over_links(const Shell& shell, const Vec3& centre, double radius);
  Row pass_at(const Shell& shell, const Link& link, const Vec3& centre, double radius) const;
  int node_of(int facet) const;
  int node_of(int facet, const Vec3& point) const;
  void collect_claims(const Shell& shell, const Vec3& centre, double radius, double tolerance);
  void drop_claims_of_neighbours(const Shell& shell);
  void claims_to_contacts(const Shell& shell, const Vec3& centre, double radius);
  void merge_equal_points(double tolerance);
  void drop_crossed(const Shell& shell, const Vec3& centre, double tolerance);
  void keep_one_side(const Shell& shell, const Vec3& centre, double radius);
  void remove_dropped();

  bool follow_, turns_ = false;
  std::vector<int> reached_;  // facets whose box meets the ball of radius + margin_ round anchor_
  const Shell* followed_ = nullptr;
  double followed_radius_ = 0, margin_ = -1;
  Vec3 anchor_, last_;

  std::vector<int> near_;  // those of them that may hold a contact
  std::vector<FaceClaim> faces_;
  std::vector<EdgeClaim> edges_;
  std::vector<VertexClaim> vertices_;
  std::vector<std::pair<int, int>> taken_edges_;
  std::vector<int> taken_vertices_, by_x_, at_point_;
  std::vector<char> dropped_;      // beside `contacts`
  std::vector<Carrier> carriers_;  // beside `contacts`, for one-sided shells only
  std::vector<Shadow> over_;
  std::vector<int> holder_;  // beside `contacts`: the facet that holds it
  std::vector<std::pair<PatchPoint, Stationary>> feet_;
  std::vector<Saddle> saddles_;
  std::vector<Row> rows_;
  std::vector<int> nodes_;             // facets
  std::vector<int> parent_, deepest_;  // per node, and then per saddle: of its piece
  std::vector<Link> links_;
};

}  // namespace sphshell
