// Gauss's rules on [0, 1].
#pragma once

namespace sphshell {

// The integral of f is about the sum of weights[i] f(nodes[i]).
struct GaussRule {
  int size;
  const double* nodes;
  const double* weights;
};

inline constexpr double kGaussNodes3[] = {0.1127016653792583, 0.5, 0.8872983346207417};
inline constexpr double kGaussWeights3[] = {0.27777777777777785, 0.4444444444444444,
                                            0.27777777777777785};
inline constexpr double kGaussNodes4[] = {0.06943184420297371, 0.33000947820757187,
                                          0.6699905217924281, 0.9305681557970262};
inline constexpr double kGaussWeights4[] = {0.17392742256872679, 0.3260725774312732,
                                            0.3260725774312732, 0.17392742256872679};
inline constexpr double kGaussNodes5[] = {0.04691007703066802, 0.23076534494715845, 0.5,
                                          0.7692346550528415, 0.9530899229693319};
inline constexpr double kGaussWeights5[] = {0.11846344252809464, 0.23931433524968315,
                                            0.28444444444444433, 0.23931433524968315,
                                            0.11846344252809464};
inline constexpr double kGaussNodes6[] = {0.03376524289842403, 0.16939530676686776,
                                          0.38069040695840156, 0.6193095930415985,
                                          0.8306046932331322,  0.9662347571015759};
inline constexpr double kGaussWeights6[] = {0.08566224618958514, 0.18038078652406936,
                                            0.23395696728634552, 0.23395696728634552,
                                            0.18038078652406936, 0.08566224618958514};
inline constexpr double kGaussNodes7[] = {
    0.0254460438286207, 0.12923440720030277, 0.2970774243113014, 0.5,
    0.7029225756886985, 0.8707655927996972,  0.9745539561713793};
inline constexpr double kGaussWeights7[] = {
    0.06474248308443487, 0.13985269574463843, 0.19091502525255935, 0.20897959183673465,
    0.19091502525255935, 0.13985269574463843, 0.06474248308443487};
inline constexpr double kGaussNodes8[] = {
    0.019855071751231912, 0.10166676129318664, 0.2372337950418355, 0.4082826787521751,
    0.5917173212478248,   0.7627662049581645,  0.8983332387068134, 0.9801449282487681};
inline constexpr double kGaussWeights8[] = {
    0.05061426814518853, 0.11119051722668721, 0.15685332293894344, 0.18134189168918083,
    0.18134189168918083, 0.15685332293894344, 0.11119051722668721, 0.05061426814518853};

// Of 3 to 8 nodes, Gauss and Legendre's: exact for polynomials of degree 2 n - 1.
inline GaussRule gauss_rule(int n) {
  static constexpr GaussRule kRules[] = {
      {3, kGaussNodes3, kGaussWeights3}, {4, kGaussNodes4, kGaussWeights4},
      {5, kGaussNodes5, kGaussWeights5}, {6, kGaussNodes6, kGaussWeights6},
      {7, kGaussNodes7, kGaussWeights7}, {8, kGaussNodes8, kGaussWeights8}};
  return kRules[n - 3];
}

}  // namespace sphshell
