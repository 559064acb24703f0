// The law of a table, such as a measured one.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

#include "sphshell_pin/laws/contact_force.hpp"
#include "sphshell_pin/laws/parameters.hpp"

namespace sphshell_pin {

/// Elastic, from a table: depths and forces start at zero and increase.
struct TableLaw {
  static constexpr const char* kind = "table";
  std::vector<double> depth;  ///< (k >= 2) [m]
  std::vector<double> force;  ///< (k) [N]

  template <class Law, class Visit>
  static void each(Law& law, Visit&& visit) {
    visit("depth", law.depth, Bounds{"m"});
    visit("force", law.force, Bounds{"N"}.beside("depth", double(law.depth.size()), false));
  }
};

}  // namespace sphshell_pin

namespace sphshell {

// Elastic, from rows of depth and force, the first of them zero: the monotone cubic Hermite
// interpolant of Fritsch and Carlson (SIAM J. Numer. Anal. 17 (1980) 238), with three-point slopes
// limited as by de Boor and Swartz; beyond the last row it goes on with the last slope.
struct TableLaw {
  using Parameters = sphshell_pin::TableLaw;
  static constexpr const char* kind = Parameters::kind;

  // Of the depth x beyond the start of a piece: force c[0] + c[1] x + c[2] x^2 + c[3] x^3 [N], and
  // energy [J] stored down to its start.
  struct Piece {
    double c[4], energy;
  };
  std::vector<double> starts;  // of the pieces [m]
  std::vector<Piece> pieces;
  // Where to search: the piece in which each of many equal intervals of depth starts.
  std::vector<std::uint32_t> cells;
  double cells_per_depth = 0;  // [1/m]

  explicit TableLaw(const Parameters& p) : starts(p.depth) {
    if (starts.size() < 2) throw std::invalid_argument("a table of a law needs 2 rows");
    const std::vector<double>& forces = p.force;
    const std::size_t last = starts.size() - 1;
    std::vector<double> h, secants, slopes(last + 1);
    for (std::size_t i = 0; i < last; ++i) {
      h.push_back(starts[i + 1] - starts[i]);
      secants.push_back((forces[i + 1] - forces[i]) / h[i]);
    }
    // Weighted mean of the neighboring secants, at most three times the smaller one: with that the
    // cubic is monotone.
    for (std::size_t i = 1; i < last; ++i)
      slopes[i] = std::min((h[i - 1] * secants[i] + h[i] * secants[i - 1]) / (h[i - 1] + h[i]),
                           3 * std::min(secants[i - 1], secants[i]));
    // At the ends the slope of the parabola through three rows; the last one stays positive.
    const auto end = [&](std::size_t at, std::size_t next, double least) {
      const double slope = secants[at] + h[at] * (secants[at] - secants[next]) / (h[at] + h[next]);
      return std::clamp(slope, least * secants[at], 3 * secants[at]);
    };
    slopes[0] = last > 1 ? end(0, 1, 0) : secants[0];
    slopes[last] = last > 1 ? end(last - 1, last - 2, 0.1) : secants[0];
    double energy = 0;
    for (std::size_t i = 0; i < last; ++i) {
      // Hermite form to powers of x.
      const double bend = slopes[i] + slopes[i + 1] - 2 * secants[i];
      pieces.push_back(
          {{forces[i], slopes[i], (secants[i] - slopes[i] - bend) / h[i], bend / (h[i] * h[i])},
           energy});
      energy = energy_at(pieces.back(), h[i]);
    }
    pieces.push_back({{forces[last], slopes[last], 0, 0}, energy});
    // Four intervals a row on average: most of them hold one piece, which is then found without a
    // search.
    const std::size_t count = 4 * last;
    std::vector<std::uint32_t> found;
    for (std::size_t k = 0; k <= count; ++k) found.push_back(piece_at(starts[last] * k / count));
    found.push_back(last);
    cells = std::move(found);
    cells_per_depth = count / starts[last];
  }

  bool needs_rate() const { return false; }

  template <class S>
  NormalForce<S> force(const S& depth, const S&, const S&) const {
    const std::size_t i = piece_at(depth);
    const auto& c = pieces[i].c;
    const S x = depth - starts[i];
    const S elastic = ((c[3] * x + c[2]) * x + c[1]) * x + c[0];
    return {elastic, elastic};
  }

  double energy(double depth, double) const {
    const std::size_t i = piece_at(depth);
    return energy_at(pieces[i], depth - starts[i]);
  }

  template <class S>
  std::size_t piece_at(const S& depth) const {
    auto first = starts.begin() + 1, end = starts.end();
    if constexpr (std::is_same_v<S, double>) {
      // Rounding may choose the neighboring piece at its end, where both agree.
      if (!cells.empty() && depth < starts.back()) {
        const std::size_t k = depth * cells_per_depth;
        end = first + cells[k + 1];
        first += cells[k];
      }
    }
    const auto deeper = [](const S& x, double start) { return x < start; };
    return std::upper_bound(first, end, depth, deeper) - starts.begin() - 1;
  }

  // The integral of the cubic, by Horner's rule.
  static double energy_at(const Piece& p, double x) {
    return p.energy + (((p.c[3] / 4 * x + p.c[2] / 3) * x + p.c[1] / 2) * x + p.c[0]) * x;
  }
};

}  // namespace sphshell
