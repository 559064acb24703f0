// The exact polyhedron: one contact at every local minimum of the distance over the surface.
#pragma once

#include <map>

#include "contact/query/broad_phase.hpp"
#include "contact/query/minimum.hpp"
#include "contact/query/regions.hpp"

namespace sphshell {

// Minima of the distance on flat facets. Keeps its memory.
class FlatQuery {
 public:
  FlatQuery() {
    // Usual numbers, so that first queries do not grow them one by one.
    faces_.reserve(64);
    edges_.reserve(64);
    vertices_.reserve(64);
  }

  void find(const Search<Sphere>& search, BroadPhase& broad) {
    const auto& [shell, sphere, want_dn_dc, minima] = search;
    // Face, edge and vertex minima of the candidates; then those found twice, those that another
    // element passes through, and vertices where sheets meet in a point only.
    broad.find(shell, shell.cones(), 0, sphere);
    find_features(shell, sphere, broad.candidates);
    if (faces_.empty() && edges_.empty() && vertices_.empty()) return;
    drop_neighbors(shell);
    add_minima(search);
    const double same = kSamePoint * sphere.radius + 16 * sphere.tolerance;
    const bool pinched = !shell.topology().pinches.empty();
    if (pinched) find_pinched(search, broad.overlapping, kPinched * same);
    if (minima.size() > 1) {
      merge_equal_points(same, minima);
      drop_crossed(search, broad.overlapping, same);
    }
    if (pinched) add_pinched(search, kPinched * same);
  }

 private:
  // A face, an edge or a vertex holds a minimum where the center lies in its normal cone with
  // respect to every triangle that meets there: triangles are convex, so this is exact.
  void find_features(const Shell& shell, const Sphere& sphere, const std::vector<int>& candidates) {
    faces_.clear(), edges_.clear(), vertices_.clear();
    const Vec3& center = sphere.center;
    const double tolerance2 = sphere.tolerance * sphere.tolerance;
    // Wider by round-off: the exact test is made where the contact is built.
    const double wide_reach2 = sphere.radius * sphere.radius * (1 + 1e-12);
    for (int f : candidates) {
      const Facet& facet = shell.facets()[f];
      const double height = facet.normal.dot(center - facet.corner[0]);
      if (height * height >= wide_reach2) continue;
      SideTest side[3];
      bool inside = true;
      for (int k = 0; k < 3; ++k) {
        side[k] = test_side(facet, k, center, tolerance2);
        inside = inside && !side[k].beyond;
      }
      if (inside) faces_.push_back(f);
      for (int k = 0; k < 3; ++k) {
        // Each edge and each vertex is owned by one facet, which alone reports it.
        if (facet.owned.twin[k] != kNotOwned && side[k].not_within && !side[k].past_first &&
            !side[k].past_second && sphere.reaches(facet.corner[k] + side[k].t * facet.side(k)) &&
            edge_is_minimum(shell, facet.owned.twin[k], center, tolerance2))
          edges_.push_back(3 * f + k);
        if (facet.owned.vertex[k] >= 0 && side[k].before && side[previous_corner(k)].after &&
            sphere.reaches(facet.corner[k]) &&
            vertex_is_minimum(shell, facet.owned.vertex[k], center, sphere.tolerance))
          vertices_.push_back(3 * f + k);
      }
    }
  }

  // A facet is convex: where its face holds the nearest point, its own edges and corners cannot,
  // and likewise an edge and its ends. Both are found only within round-off of their common border.
  void drop_neighbors(const Shell& shell) {
    if (edges_.empty() && vertices_.empty()) return;
    // Edges and vertices of faces that hold a minimum, then the ends of edges that do: those of the
    // list are dropped.
    taken_edges_.clear();
    taken_vertices_.clear();
    const auto edge_of = [&](int h) { return shell.topology().edge_of[shell.half_edge(h)]; };
    const auto vertex_of = [&](int corner) { return shell.vertex(shell.half_edge(corner)); };
    const auto is_in = [](const std::vector<int>& sorted, int one) {
      return std::binary_search(sorted.begin(), sorted.end(), one);
    };
    for (int face : faces_)
      for (int h = 3 * face; h < 3 * face + 3; ++h)
        taken_edges_.push_back(edge_of(h)), taken_vertices_.push_back(vertex_of(h));
    std::sort(taken_edges_.begin(), taken_edges_.end());
    erase_if(edges_, [&](int h) { return is_in(taken_edges_, edge_of(h)); });
    for (int h : edges_)
      for (int corner : {h, corner_after(h)}) taken_vertices_.push_back(vertex_of(corner));
    std::sort(taken_vertices_.begin(), taken_vertices_.end());
    erase_if(vertices_, [&](int corner) { return is_in(taken_vertices_, vertex_of(corner)); });
  }

  // Closed forms: dx/dc is the projection on the plane for a face (its normal stays), on the line
  // for an edge, zero for a vertex.
  void add_minima(const Search<Sphere>& search) {
    const Sphere& sphere = search.probe;
    const LargeArray<Facet>& facets = search.shell.facets();
    // A planar face has one nearest point, whichever of its facets hold it.
    std::sort(faces_.begin(), faces_.end(), [&](int x, int y) {
      const Facet &a = facets[x], &b = facets[y];
      return a.planar_face != b.planar_face ? a.planar_face < b.planar_face : a.element < b.element;
    });
    for (std::size_t i = 0; i < faces_.size(); ++i) {
      const Facet& facet = facets[faces_[i]];
      if (i > 0 && facets[faces_[i - 1]].planar_face == facet.planar_face) continue;
      const double height = facet.normal.dot(sphere.center - facet.corner[0]);
      if (std::abs(height) < sphere.radius)
        search.minima.push_back(over_facet(faces_[i], facet, height, sphere));
    }
    for (const int h : edges_) {
      const Facet& facet = facets[triangle_of(h)];
      const Vec3 &a = facet.corner[side_of(h)], along = facet.side(side_of(h));
      const double t = std::clamp((sphere.center - a).dot(along) / along.squaredNorm(), 0.0, 1.0);
      search.minima.push_back(
          search.at(triangle_of(h), side_of(h), Feature::Edge, a + t * along, facet.normal,
                    [&]() -> Mat3 { return along * along.transpose() / along.squaredNorm(); }));
    }
    for (const int corner : vertices_)
      search.minima.push_back(search.at_corner(triangle_of(corner), side_of(corner)));
  }

  // The simplest feature wins (face, edge, vertex: the order in which minima were listed).
  void merge_equal_points(double tolerance, std::vector<Minimum>& minima) {
    dropped_.assign(minima.size(), 0);
    for_each_near(minima, tolerance, by_x_, [&](int first, int second) {
      int& element = minima[first].contact.element;
      element = std::min(element, minima[second].contact.element);
      dropped_[second] = 1;
    });
    remove_dropped(minima);
  }

  // Elements may overlap or cross without sharing an edge. Where another one passes through a
  // contact point and comes nearer to the center, the distance has no minimum there. The deepest
  // contact is the nearest point of all, so a single one needs no such test.
  void drop_crossed(const Search<Sphere>& search, const std::vector<int>& overlapping,
                    double tolerance) {
    const Shell& shell = search.shell;
    const Vec3& center = search.probe.center;
    std::vector<Minimum>& minima = search.minima;
    if (minima.size() < 2) return;
    const auto crossed = [&](const Vec3& point, const std::vector<int>& facets) {
      const double nearer = std::max(0.0, (center - point).norm() - tolerance);
      return std::any_of(facets.begin(), facets.end(), [&](int f) {
        const Facet& facet = shell.facets()[f];
        if (std::abs(facet.normal.dot(point - facet.corner[0])) > tolerance) return false;
        const Vec3 here = closest_on_triangle(point, facet.corner, facet.normal).point;
        if ((point - here).squaredNorm() > tolerance * tolerance) return false;
        const Vec3 best = closest_on_triangle(center, facet.corner, facet.normal).point;
        return (center - best).squaredNorm() < nearer * nearer;
      });
    };
    // With many facets at hand it is cheaper to use_tree the tree for those at each point.
    const bool use_tree = overlapping.size() > 256;
    dropped_.assign(minima.size(), 0);
    for (std::size_t i = 0; i < minima.size(); ++i) {
      const Vec3& point = minima[i].contact.point;
      if (use_tree) {
        at_point_.clear();
        shell.bvh().find_overlapping(point, 2 * tolerance, at_point_, [](int) {});
      }
      dropped_[i] = crossed(point, use_tree ? at_point_ : overlapping);
    }
    remove_dropped(minima);
  }

  void remove_dropped(std::vector<Minimum>& minima) const {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < minima.size(); ++i)
      if (!dropped_[i]) minima[kept++] = minima[i];
    minima.resize(kept);
  }

  // Where fans share a vertex and no side, each has its own minimum there: when that goes over to a
  // face, it counts whatever the other fans do. Between pieces of the surface that are not
  // connected otherwise the vertex is a saddle, of those between the same two the deepest
  // (Kruskal).
  void find_pinched(const Search<Sphere>& search, const std::vector<int>& overlapping,
                    double tolerance) {
    const auto& [shell, sphere, want_dn_dc, minima] = search;
    // The vertices of this kind that the sphere reaches, deepest first, each once.
    pinched_.clear();
    for (int f : overlapping)
      for (int vertex : shell.triangles()[shell.triangle_of_facet(f)])
        if (const Pinch* at = shell.topology().pinch_at(vertex)) {
          const double depth = sphere.radius - (shell.vertices()[vertex] - sphere.center).norm();
          if (depth > 0) pinched_.push_back({at, depth, {}, 0});
        }
    std::sort(pinched_.begin(), pinched_.end(), [](const Pinched& x, const Pinched& y) {
      return x.depth != y.depth ? x.depth > y.depth : x.at < y.at;
    });
    const auto same = [](const Pinched& x, const Pinched& y) { return x.at == y.at; };
    pinched_.erase(std::unique(pinched_.begin(), pinched_.end(), same), pinched_.end());
    std::map<int, int> joined;  // a piece to another one, nearer to the first of those joined
    const auto root = [&](int piece) {
      for (auto at = joined.find(piece); at != joined.end(); at = joined.find(piece))
        piece = at->second;
      return piece;
    };
    for (Pinched& pinched : pinched_)
      for (std::size_t i = 0; i < pinched.at->fans.size(); ++i) {
        const std::vector<int>& fan = pinched.at->fans[i];
        if (has_minimum(shell, minima, pinched.at->vertex, fan, tolerance) ||
            fan_is_minimum(shell, fan, sphere.center, sphere.tolerance))
          pinched.fans.push_back(&fan);
        const int one = root(pinched.at->piece[0]), other = root(pinched.at->piece[i]);
        if (one != other) joined[other] = one, ++pinched.saddles;
      }
  }

  // Adds the minima of fans that were taken for one with another's, or dropped as no minimum of the
  // whole; and the saddles, each of which takes one of these away.
  void add_pinched(const Search<Sphere>& search, double tolerance) const {
    const Shell& shell = search.shell;
    for (const auto& [at, depth, fans, saddles] : pinched_) {
      int more = -saddles;
      for (const std::vector<int>* fan : fans)
        more += !has_minimum(shell, search.minima, at->vertex, *fan, tolerance);
      const int h = shell.facet_half_edge(at->fans[0][0]);
      Minimum one = search.at_corner(triangle_of(h), side_of(h));
      if (more < 0) one.contact.weight = -1, one.contact.dn_dc *= -1;
      search.minima.insert(search.minima.end(), std::abs(more), one);
    }
  }

  // Whether a minimum is found at a vertex, on a triangle that one of a fan's corners belongs to.
  // tolerance [m]: how far from the vertex the minimum may be.
  static bool has_minimum(const Shell& shell, const std::vector<Minimum>& minima, int vertex,
                          const std::vector<int>& fan, double tolerance) {
    return std::any_of(minima.begin(), minima.end(), [&](const Minimum& at) {
      const Vec3 away = at.contact.point - shell.vertices()[vertex];
      const int t = shell.triangle_of_facet(at.facet);
      return away.squaredNorm() <= tolerance * tolerance &&
             std::any_of(fan.begin(), fan.end(), [t](int c) { return triangle_of(c) == t; });
    });
  }

  // A pinched vertex inside the sphere. The fans there that have a minimum, each by itself; and how
  // many saddles are between them.
  struct Pinched {
    const Pinch* at;
    double depth;
    std::vector<const std::vector<int>*> fans;
    int saddles;
  };

  std::vector<int> faces_;             // facets that the center projects into
  std::vector<int> edges_, vertices_;  // 3 facet + k: those that may hold the closest point
  std::vector<int> taken_edges_, taken_vertices_, by_x_, at_point_;
  std::vector<char> dropped_;
  std::vector<Pinched> pinched_;
};

}  // namespace sphshell
