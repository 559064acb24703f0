// Contacts of spheres with a surface, both from standard input: what Python compares with its own.
#include <sphshell_pin/query.hpp>

#include <cstdio>
#include <iostream>

using namespace sphshell_pin;

int main() {
  std::size_t vertices, elements, queries;
  std::cin >> vertices >> elements >> queries;
  Surface surface{Points(vertices), std::vector<Element>(elements)};
  for (Eigen::Vector3d& p : surface.vertices) std::cin >> p[0] >> p[1] >> p[2];
  for (Element& e : surface.elements) std::cin >> e.first >> e.second >> e.third >> e.fourth;
  const Shell shell(surface);
  Query query;
  for (std::size_t k = 0; k < queries; ++k) {
    Eigen::Vector3d center;
    double radius;
    int method;
    std::cin >> center[0] >> center[1] >> center[2] >> radius >> method;
    for (const Contact& c : query.contacts(shell, center, radius, static_cast<Method>(method)))
      std::printf("%zu %.17g %.17g %.17g %.17g %.17g %.17g %.17g %d %d %g\n", k, c.point[0],
                  c.point[1], c.point[2], c.normal[0], c.normal[1], c.normal[2], c.depth, c.element,
                  static_cast<int>(c.feature), c.weight);
  }
}
