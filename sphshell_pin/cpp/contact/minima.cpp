// Contacts that flow together: the sphere counts a piece of surface inside it once.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "contact/query.hpp"
#include "shell/curved.hpp"
#include "shell/triangle.hpp"

namespace sphshell {
namespace {

// Two minima are one contact where the pass between them is no more than this share of its depth
// below both: what that changes of the force is the square of it. Between curved elements, which
// meet at small angles that nobody meant, the share is larger.
constexpr double kShallow = 1e-4, kShallowOnPatch = 1e-2;
// ... and their normals differ from its by no more than this [rad].
constexpr double kAlike = 0.03;

// Where one ends who goes from facet to facet over the flat elements, each time to the nearest.
Vec3 walk_down(const Shell& shell, const Vec3& centre, int facet) {
  const auto closest = [&](int f) {
    return closest_on_triangle(centre, shell.facets()[f].corner, shell.facets()[f].normal);
  };
  ClosestPoint at = closest(facet);
  for (bool moved = true; moved;) {
    moved = false;
    const int from = facet;
    const auto visit = [&](int f) {
      if (f == from) return;
      const ClosestPoint other = closest(f);
      if ((other.point - centre).squaredNorm() >= (at.point - centre).squaredNorm()) return;
      at = other;
      facet = f;
      moved = true;
    };
    const int t = shell.triangle_of_facet(from), feature = at.feature;
    if (feature >= 4) {
      for (int c : shell.curved()->corners_of(shell.triangles()[t][feature - 4]))
        visit(triangle_of(c));
    } else if (feature >= 1) {
      const Topology& topology = shell.topology();
      const Edge& edge = topology.edges[topology.edge_of[3 * t + feature - 1]];
      for (int i = 0; i < edge.count; ++i)
        visit(triangle_of(shell.facet_half_edge(topology.incidence[edge.begin + i])));
    }
  }
  return at.point;
}

}  // namespace

// The elastic potential of a sphere is the sum of U(depth) over the minima of the distance, less
// U(depth) of each pass that joins two of them: as much as U'(s) times the number of pieces that
// the surface has inside a sphere smaller by s, summed over s. Where a minimum ends it meets a
// pass, with the same depth and normal, so neither the potential nor the force jumps.
void Query::join_minima(const Shell& shell, const Vec3& centre, double radius) {
  const double same = 1e-8 * radius;
  // Deepest first; then one contact per place.
  std::vector<int>& order = by_x_;
  order.resize(contacts.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int i, int j) {
    const Contact &a = contacts[i], &b = contacts[j];
    return a.depth != b.depth ? a.depth > b.depth : a.element < b.element;
  });
  std::vector<int>& kept = at_point_;
  kept.clear();
  for (int i : order) {
    const bool known = std::any_of(kept.begin(), kept.end(), [&](int j) {
      return (contacts[j].point - contacts[i].point).squaredNorm() <= same * same;
    });
    if (!known) kept.push_back(i);
  }
  rows_.clear();
  for (int i : kept) {
    Row row;
    row.contact = contacts[i];
    row.carrier = carriers_.empty() ? Carrier{Vec3::Zero(), false} : carriers_[i];
    row.face = carrier_face_[i];
    row.root = row.merged = static_cast<int>(rows_.size());
    row.normal = row.contact.normal;
    row.depth = row.contact.depth;
    row.turn = row.contact.turn;
    rows_.push_back(row);
  }
  const std::size_t minima = rows_.size();
  if (minima > 1) {
    join_over_passes(shell, centre, minima, same);
    drop_twins(shell, minima, radius);
  }
  contacts.clear();
  const bool one_sided = !carriers_.empty();
  carriers_.clear();
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    Row& row = rows_[i];
    if (row.merged != static_cast<int>(i)) continue;
    if (row.depth != row.contact.depth) {
      row.contact.depth = row.depth;
      row.contact.weight = row.normal.norm();
      row.contact.normal = row.normal / row.contact.weight;
      row.contact.point = centre - (radius - row.depth) * row.contact.normal;
      row.contact.turn = row.turn;
    }
    contacts.push_back(row.contact);
    if (one_sided) carriers_.push_back(row.carrier);
  }
}

// The minimum that a leg leads to, -1 if none. Over flat elements one walks down, and takes what is
// nearest to where that ends. On a curved patch all is close together and the leg's direction
// tells; only from a crease may it lead to another patch.
int Query::minimum_below(const Shell& shell, const Vec3& centre, const Pass& pass, const Leg& leg,
                         std::size_t minima, double same) const {
  const bool flat = shell.curved()->facets()[leg.facet].flat;
  const Vec3 end = flat ? walk_down(shell, centre, leg.facet) : pass.contact.point;
  const std::vector<int>& patch = shell.topology().patch;
  const int here = patch[shell.facets()[leg.facet].element];
  int best = -1, best_here = -1;
  double nearest = std::numeric_limits<double>::infinity(), nearest_here = nearest;
  for (std::size_t i = 0; i < minima; ++i) {
    if (rows_[i].contact.depth < pass.contact.depth - same) continue;  // no way down ends higher
    const Vec3 way = rows_[i].contact.point - end;
    double distance = way.norm();
    if (!flat) {
      const double along = way.dot(leg.direction);
      if (distance <= same || along < 0.3 * distance) continue;
      distance += 20 * (distance - along);
    }
    if (distance < nearest) nearest = distance, best = static_cast<int>(i);
    if (distance < nearest_here && patch[rows_[i].contact.element] == here)
      nearest_here = distance, best_here = static_cast<int>(i);
  }
  return flat || (pass.sharp && best_here < 0) ? best : best_here;
}

// Highest pass first, as water rises: it joins what is not joined yet (Kruskal).
void Query::join_over_passes(const Shell& shell, const Vec3& centre, std::size_t minima,
                             double same) {
  std::sort(passes_.begin(), passes_.end(), [](const Pass& a, const Pass& b) {
    return a.contact.depth != b.contact.depth ? a.contact.depth > b.contact.depth
                                              : a.contact.element < b.contact.element;
  });
  const auto find = [&](int i, int Row::* link) {
    while (rows_[i].*link != i) i = rows_[i].*link;
    return i;
  };
  for (const Pass& pass : passes_) {
    const Contact& at = pass.contact;
    // A minimum here is about to end, or is none: it and the pass cancel.
    int here_too = -1, joined = 0;
    for (std::size_t i = 0; i < minima && here_too < 0; ++i)
      if ((rows_[i].contact.point - at.point).squaredNorm() <= same * same)
        here_too = static_cast<int>(i);
    int first = here_too;
    for (int leg = pass.first_leg; leg < pass.last_leg; ++leg) {
      const int here = minimum_below(shell, centre, pass, legs_[leg], minima, same);
      if (here < 0) continue;
      if (first < 0) {
        first = here;
        continue;
      }
      int a = find(first, &Row::root), b = find(here, &Row::root);
      if (a == b) continue;
      if (a > b) std::swap(a, b);  // the deeper one stays
      rows_[b].root = a;
      if (first == here_too && rows_[first].merged == first) {
        rows_[first].merged = find(here, &Row::merged);
        first = here;
        continue;
      }
      const bool meant = pass.sharp || shell.curved()->facets()[legs_[leg].facet].flat;
      const double share = meant ? kShallow : kShallowOnPatch;
      const auto near = [&](const Contact& minimum) {
        return minimum.depth - at.depth < share * at.depth &&
               (minimum.normal - at.normal).squaredNorm() < kAlike * kAlike;
      };
      int m = find(first, &Row::merged), n = find(here, &Row::merged);
      if (m > n) std::swap(m, n);
      if (!near(rows_[first].contact) || !near(rows_[here].contact) || !near(rows_[m].contact) ||
          !near(rows_[n].contact)) {
        ++joined;
        continue;
      }
      rows_[n].merged = m;
      rows_[m].depth += rows_[n].depth - at.depth;
      rows_[m].normal += rows_[n].normal - at.normal;
      rows_[m].turn += rows_[n].turn - at.turn;
    }
    if (joined == 0) continue;
    Row row;
    row.contact = at;
    row.contact.weight = -joined;
    row.contact.turn *= -joined;
    row.carrier = pass.carrier;
    row.face = kSharp;
    row.root = row.merged = static_cast<int>(rows_.size());
    row.normal = at.normal;
    row.depth = at.depth;
    rows_.push_back(row);
  }
}

// Minima on one smooth patch that no pass joins though they lie within one contact disc (radius
// sqrt(r^2 - distance^2)): the pass was lost to round-off, and the deepest counts.
void Query::drop_twins(const Shell& shell, std::size_t minima, double radius) {
  const std::vector<int>& patch = shell.topology().patch;
  for (std::size_t i = 1; i < minima; ++i) {
    const Row& row = rows_[i];
    if (row.root != static_cast<int>(i) || row.face == kSharp) continue;
    for (std::size_t j = 0; j < i; ++j) {
      const Row& deeper = rows_[j];
      if (deeper.merged != static_cast<int>(j) || deeper.face == kSharp) continue;
      if (std::min(row.face, deeper.face) != kCurved && row.face != deeper.face) continue;
      const double distance = radius - deeper.contact.depth;
      const double apart2 = (deeper.contact.point - row.contact.point).squaredNorm();
      if (patch[deeper.contact.element] != patch[row.contact.element] ||
          apart2 >= radius * radius - distance * distance)
        continue;
      const bool alone = std::none_of(rows_.begin(), rows_.begin() + minima, [&](const Row& r) {
        return &r != &row && r.root == static_cast<int>(i);
      });
      if (alone) rows_[i].merged = static_cast<int>(j);
      break;
    }
  }
}

}  // namespace sphshell
