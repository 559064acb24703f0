// The corners that meet at a vertex, joined where the surface goes on smoothly between them.
#pragma once

#include "shell/disjoint_sets.hpp"
#include "shell/shell.hpp"

namespace sphshell {

// A corner (3 triangle + k) belongs to one fan. Fans are numbered by their first corners.
class Fans {
 public:
  // is_smooth(edge): whether the two triangles of an edge join the fans at its ends.
  template <class IsSmooth>
  Fans(const Shell& shell, IsSmooth&& is_smooth) : shell_(shell) {
    const int corners = 3 * static_cast<int>(shell.triangles().size());
    // Corners of two triangles at both ends of a smooth edge are one; opposed: wound alike.
    DisjointSets sets(corners);
    for (const Edge& edge : shell.topology().edges) {
      if (edge.count != 2 || !is_smooth(edge)) continue;
      const auto [h, g] = shell.topology().half_edges(edge);
      const bool opposed = shell.opposed(h, g);
      sets.merge(h, opposed ? corner_after(g) : g);
      sets.merge(corner_after(h), opposed ? g : corner_after(g));
    }
    // Counting sort of the corners by fan; begin_[fan + 1] runs from its beginning to its end.
    fan_of_ = sets.labels();
    begin_.assign(sets.count() + 2, 0);
    for (const int fan : fan_of_) ++begin_[fan + 2];
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    members_.resize(corners);
    for (int c = 0; c < corners; ++c) members_[begin_[fan_of_[c] + 1]++] = c;
    begin_.pop_back();
  }

  int size() const { return static_cast<int>(begin_.size()) - 1; }
  int of(int corner) const { return fan_of_[corner]; }
  int count(int fan) const { return begin_[fan + 1] - begin_[fan]; }
  // Its corners, ascending.
  Span operator[](int fan) const {
    return {members_.data() + begin_[fan], members_.data() + begin_[fan + 1]};
  }

  // The vertices two edges or less from the fan's own, through triangles that smooth edges join
  // and not past a sharp vertex.
  void vertices_around(int fan, const std::vector<char>& sharp, std::vector<int>& out) const {
    const int own = shell_.vertex(*(*this)[fan].first);
    const auto sort = [&out](std::size_t from) {
      std::sort(out.begin() + from, out.end());
      out.erase(std::unique(out.begin() + from, out.end()), out.end());
    };
    out.clear();
    for (const int c : (*this)[fan])
      for (int k = 0; k < 3; ++k) out.push_back(fan_of_[c / 3 * 3 + k]);
    sort(0);
    // The fans, and behind them the vertices around each, of which most are found several times.
    // The fans' own vertices are around `fan`, which is not sharp.
    const std::size_t fans = out.size();
    for (std::size_t i = 0; i < fans; ++i) {
      if (sharp[out[i]]) continue;
      for (const int d : (*this)[out[i]])
        for (const int other : {corner_after(d), corner_before(d)}) {
          const int v = shell_.vertex(other);
          if (v != own && (out.size() > fans + kFew ||
                           std::find(out.begin() + fans, out.end(), v) == out.end()))
            out.push_back(v);
        }
    }
    sort(fans);
    out.erase(out.begin(), out.begin() + fans);
  }

 private:
  static constexpr std::size_t kFew = 64;  // numbers that are looked through one by one

  const Shell& shell_;
  std::vector<int> begin_, fan_of_;
  LargeArray<int> members_;
};

// What a facet counts for at its corner, and the normal of a fan, exact where the vertices lie on a
// sphere (Max, J. Graphics Tools 4 (1999) 1).
double max_weight(const Shell& shell, int corner);
Vec3 max_normal(const Shell& shell, Span corners);

}  // namespace sphshell
