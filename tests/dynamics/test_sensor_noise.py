"""The noise of sensors: normal, and the same bits everywhere."""

from math import erf

import numpy as np

from sphshell_pin import _core


def splitmix(x):
    mask = (1 << 64) - 1
    x = (x + 0x9E3779B97F4A7C15) & mask
    x = ((x ^ (x >> 30)) * 0xBF58476D1CE4E5B9) & mask
    x = ((x ^ (x >> 27)) * 0x94D049BB133111EB) & mask
    return x ^ (x >> 31)


def test_noise_is_the_same_on_every_machine():
    """Integers alone decide, and one division that IEEE 754 rounds."""
    for seed, sample, value in ((0, 0, 0), (1, 2, 3), (2**64 - 1, 10**6, 5)):
        key = splitmix(splitmix(splitmix(seed) ^ sample) ^ value)
        total = sum(bin(splitmix(key ^ splitmix(i))).count("1") for i in range(4)) - 128.0
        rest = splitmix(key ^ splitmix(4))
        total += (rest >> 32) * 2.0**-32 - (rest & 0xFFFFFFFF) * 2.0**-32
        assert _core.normal_noise(seed, sample, value) == total / 8.010409893800427


def test_noise_is_normal():
    n = 200_000
    x = np.array([_core.normal_noise(7, k, 0) for k in range(n)])
    assert abs(x.mean()) < 4 / np.sqrt(n)
    assert abs(x.std() - 1) < 4 / np.sqrt(2 * n)
    assert abs((x**3).mean()) < 4 * np.sqrt(15 / n)
    assert abs((x**4).mean() - 3) < 4 * np.sqrt(96 / n) + 0.01
    # Kolmogorov and Smirnov: 1.63 / sqrt(n) at one in a hundred.
    cdf = np.array([0.5 * (1 + erf(v / np.sqrt(2))) for v in np.sort(x)])
    assert np.abs(cdf - np.arange(n) / n).max() < 1.63 / np.sqrt(n)
    assert abs(np.corrcoef(x[1:], x[:-1])[0, 1]) < 4 / np.sqrt(n)
