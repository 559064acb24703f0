// The shell: a surface of three- and four-sided elements that spheres can touch.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "sphshell_pin/errors.hpp"

namespace sphshell_pin {

using Points = std::vector<Eigen::Vector3d>;

/// Vertex indices of a triangle, or with `fourth` >= 0 of a quad, counterclockwise from outside.
struct Element {
  int first, second, third, fourth = -1;
};

/// On which side of the surface spheres may be: both, where the normals of the winding point, or
/// behind it.
enum class Side { Both = 0, Outside = 1, Inside = 2 };

struct ShellOptions {
  /// Edges that turn by less are smooth [rad], 0 to pi; with 0 every element stays flat.
  double crease_angle = 0.52359877559829882;
  Side side = Side::Both;
  /// Unit normals of the true surface at the vertices, beside them; empty: they are estimated.
  Points normals = {};
};

/// Vertices and elements of a surface [m].
struct Surface {
  Points vertices;
  std::vector<Element> elements;
};

/// Merges vertices that are nearer to each other than `tolerance` [m], as those of an STL file,
/// and drops the elements that have no area then. The winding stays as it is.
/// @param tolerance 0: 1e-7 of the diagonal of the vertices' box
/// @throws InvalidShell on vertices that are not finite, indices that name no vertex, or if no
///         element is left
/// @throws InvalidParameter on a tolerance that is negative or not finite
SPHSHELL_PIN_API Surface weld(const Surface& surface, double tolerance = 0);

/// A surface of elements in its own frame [m], open or closed. It is constant: copies share it, and
/// threads may.
class SPHSHELL_PIN_API Shell {
 public:
  /// Takes the elements as they are, as Python's Shell(..., clean=False) does: elements that are to
  /// share an edge must share its two vertices, and be wound alike. See weld().
  /// @throws InvalidShell on fewer than three vertices, no elements, vertices that are not finite,
  ///         indices that name no vertex, elements without an area, normals of another number than
  ///         vertices, or a size beyond 1e-12 to 1e15 m
  /// @throws InvalidParameter on a crease angle or side out of range
  Shell(Points vertices, const std::vector<Element>& elements, const ShellOptions& options = {});
  explicit Shell(const Surface& surface, const ShellOptions& options = {});
  // A move is a copy, which is cheap: no shell is ever without its surface.
  Shell(const Shell&) = default;
  Shell& operator=(const Shell&) = default;

  const Points& vertices() const;
  int num_elements() const;
  /// Diagonal of the box [m].
  double size() const;
  double crease_angle() const;
  Side side() const;

  struct Impl;
  /// For the library itself.
  const Impl& impl() const { return *impl_; }

 private:
  std::shared_ptr<const Impl> impl_;
};

}  // namespace sphshell_pin
