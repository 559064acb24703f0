// How the coordinates of a chart answer the motion that they stand for.
#pragma once

#include "dynamics/integrators/chart.hpp"

namespace sphshell {

// The change of what has `slopes` by a state that changes by `by`, and `own` by the first columns'
// parameters.
MatrixX applied(const Eigen::Ref<const MatrixX>& slopes, const MatrixX& by,
                const Eigen::Ref<const MatrixX>& own);

// Of the parts u and w of y and of their rates, at one y of a chart. Changes of a state have one
// column each: of q in its tangent space (nv), of v (nv) and of the bristles z; those of y, of u, w
// and z, likewise. The chart moves with its origin: `origin` is the change of that.
class ChartSlopes {
 public:
  // The maps at y, for the calls below.
  void begin(Chart& chart, const VectorX& y);

  // The changes of the state that go with those of origin and y.
  MatrixX place(const MatrixX& origin, const MatrixX& by) const;
  // The changes of the rates of y, from those of y and of the state there, and from those of (v',
  // z'), in whose place they are written. The acceleration and v are those at y.
  void rates(const VectorX& acceleration, const VectorX& v, const MatrixX& by, const MatrixX& state,
             MatrixX& out) const;

 private:
  struct Segment : CurvedSegment {
    Mat3 turn;  // of the body against the chart's axes
    // turn^T d turn as an angle by du, its inverse, and the rate of the angle u by u.
    Mat3 angle, rate_by_w, rate_by_u;
    Vec3 u, velocity;  // of the position, in the body's axes
  };
  int nv_ = 0;
  std::vector<Segment> segments_;
};

// Less [v, x] by a change x of q, which turns as the body moves with the velocity v: added to the
// top left of a matrix.
void add_turning(const Multibody& body, const VectorX& v, MatrixX& matrix);

}  // namespace sphshell
