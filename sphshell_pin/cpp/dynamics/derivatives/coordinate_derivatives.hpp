// How the coordinates of a chart answer the motion that they stand for.
#pragma once

#include "dynamics/integrators/chart.hpp"

namespace sphshell {

// Changes of a state, one column each: of q in its tangent space, of v and of the bristles z.
struct Tangent {
  MatrixX q, v, z;
};

// The change of what has `slopes` by (u, v, z), and `own` by the first columns' parameters.
MatrixX applied(const MatrixX& slopes, const Tangent& by, const Eigen::Ref<const MatrixX>& own);

// Of the parts u and w of y and of their rates, at one y of a chart. The chart moves with its
// origin: `origin` is the change of that, in its tangent space.
class ChartSlopes {
 public:
  // The maps at y, for the calls below.
  void begin(Chart& chart, const VectorX& y);

  // The changes of q and v that go with those of origin, u and w.
  void place(const MatrixX& origin, const MatrixX& u, const MatrixX& w, MatrixX& q,
             MatrixX& v) const;
  // The changes of the rates of u and w, from those of u, w and v, and from that of the
  // acceleration, in whose place the last one is written. The acceleration and v are those at y.
  void rates(const VectorX& acceleration, const VectorX& v, const MatrixX& u, const MatrixX& w,
             const MatrixX& v_by, MatrixX& u_rate, MatrixX& w_rate) const;

 private:
  struct Segment {
    CurvedSegment::Group group;
    int at;
    Mat3 turn = Mat3::Identity();  // of the body against the chart's axes
    // turn^T d turn as an angle by du, its inverse, and the rate of the angle u by u.
    Mat3 angle = Mat3::Identity(), rate_by_w = Mat3::Identity(), rate_by_u = Mat3::Zero();
    Vec3 u = Vec3::Zero(), velocity = Vec3::Zero();  // of the position, in the body's axes
  };
  std::vector<Segment> segments_;
};

// Less [v, x] by a change x of q, which turns as the body moves with the velocity v: added to the
// top left of a matrix.
void add_turning(const Multibody& body, const VectorX& v, MatrixX& matrix);

}  // namespace sphshell
