"""Contact laws as their documents print them, scalar by scalar."""


def step(x: float, x0: float, h0: float, x1: float, h1: float) -> float:
    """ADAMS STEP: cubic from h0 at x0 to h1 at x1, constant outside."""
    if x <= x0:
        return h0
    if x >= x1:
        return h1
    u = (x - x0) / (x1 - x0)
    return h0 + (h1 - h0) * u * u * (3.0 - 2.0 * u)


def impact(x: float, x_rate: float, x1: float, k: float, e: float, cmax: float, d: float) -> float:
    """ADAMS IMPACT of the distance x with free length x1."""
    if x >= x1:
        return 0.0
    return max(0.0, k * (x1 - x) ** e - step(x, x1 - d, cmax, x1, 0.0) * x_rate)


def hunt_crossley(depth: float, gap_rate: float, k: float, e: float, dissipation: float) -> float:
    """Hunt-Crossley: k depth^e (1 + dissipation depth_rate), never a pull."""
    return max(0.0, k * depth**e * (1.0 - dissipation * gap_rate)) if depth > 0 else 0.0


def coulomb(slip: float, mu_s: float, mu_d: float, v_s: float, v_d: float) -> float:
    """Two-velocity coefficient for slip >= 0, as one product of two STEPs."""
    return step(slip, -v_s, -1.0, v_s, 1.0) * step(slip, v_s, mu_s, v_d, mu_d)
